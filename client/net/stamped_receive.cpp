// See stamped_receive.hpp.
#include "client/net/stamped_receive.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <chrono>
#include <cstring>
#include <ctime>

namespace tandem::client {
namespace {

constexpr Duration kMaxAge = std::chrono::seconds(10);

Duration duration_of(const timespec& time) {
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// Since the stamp; zero where there is none.
Duration age_of(msghdr& message) noexcept {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{}, wall{};
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    clock_gettime(CLOCK_REALTIME, &wall);
    const Duration age = duration_of(wall) - duration_of(stamp);
    return age > Duration{0} && age < kMaxAge ? age : Duration{0};
  }
  return Duration{0};
}

}  // namespace

void stamp_what_comes(int socket) noexcept {
  const int on = 1;
  static_cast<void>(setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on));
}

std::optional<std::size_t> receive_stamped(int socket, std::span<std::byte> buffer, const Clock& clock,
                                           LocalTime& came) noexcept {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
  iovec place{buffer.data(), buffer.size()};
  msghdr message{};
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(socket, &message, MSG_DONTWAIT);
  if (size < 0) return std::nullopt;
  const Duration age = age_of(message);
  came = clock.now() - age;
  return static_cast<std::size_t>(size);
}

}  // namespace tandem::client

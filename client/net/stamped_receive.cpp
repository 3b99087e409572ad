#include "client/net/stamped_receive.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>

namespace tandem::client {
namespace {

/// Two clocks are assumed to have run alike if their advances differ by at most the sum of two parts:
/// * a constant part, for delays of the thread between the readings of the clocks
/// * 1/1000 of the time, because NTP slews a clock by at most 500 ppm
constexpr Duration kMaxApart = std::chrono::milliseconds(5);
constexpr Duration::rep kSlewed = 1000;

Duration duration_of(const timespec& time) {
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

Duration wall_clock() noexcept {
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);
  return duration_of(wall);
}

/// Returns the kernel's time stamp of a message, on the wall clock; nothing if the message has no stamp.
std::optional<Duration> stamp_of(msghdr& message) noexcept {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    return duration_of(stamp);
  }
  return std::nullopt;
}

}  // namespace

Duration believed_age(Duration waited, Duration empty_for, Duration empty_for_wall) noexcept {
  const bool was_set = std::chrono::abs(empty_for_wall - empty_for) > kMaxApart + empty_for / kSlewed;
  return !was_set && waited >= Duration{0} && waited <= empty_for ? waited : empty_for;
}

StampedReceiver::StampedReceiver(int socket, LocalTime now) noexcept
    : socket_(socket), empty_at_(now), wall_at_empty_(wall_clock()) {
  const int on = 1;
  static_cast<void>(setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on));
}

std::optional<std::size_t> StampedReceiver::receive(std::span<std::byte> buffer, const Clock& clock,
                                                    LocalTime& came) noexcept {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
  iovec place{buffer.data(), buffer.size()};
  msghdr message{};
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const LocalTime before = clock.now();
  const Duration wall_before = wall_clock();
  const ssize_t size = recvmsg(socket_, &message, MSG_DONTWAIT);
  if (size < 0) {
    if (errno != EAGAIN && errno != EWOULDBLOCK) return std::nullopt;
    empty_at_ = before;
    wall_at_empty_ = wall_before;
    return std::nullopt;
  }
  const Duration wall = wall_clock();
  const LocalTime now = clock.now();
  const auto stamp = stamp_of(message);
  const Duration empty_for = std::max(Duration{0}, now - empty_at_);
  came = stamp ? now - believed_age(wall - *stamp, empty_for, wall - wall_at_empty_) : now;
  return static_cast<std::size_t>(size);
}

}  // namespace tandem::client

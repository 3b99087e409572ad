// A line (pipe or TCP) to a device with a small buffer, and a reader that checks that only whole frames arrive.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::devices {

inline constexpr std::size_t kFrame = 300;
inline constexpr std::uint8_t kMagic = 0xa5, kZero = 0, kForce = 1, kReply = 2, kOwnZero = 3;
/// Returns a frame: the magic number, the kind, and `known_releases`. This is the number of force releases by the
/// watchdog that the owner process knew of when it wrote the frame. All other bytes repeat the kind.
inline std::vector<std::uint8_t> frame_of(std::uint8_t kind, std::uint32_t known_releases = 0) {
  std::vector<std::uint8_t> frame(kFrame, kind);
  frame[0] = kMagic;
  frame[2] = static_cast<std::uint8_t>(known_releases);
  return frame;
}

enum class LineKind : std::uint8_t { kPipe, kTcp };

/// Both ends of a line with a small buffer.
struct TestLine {
  explicit TestLine(LineKind kind) {
    if (kind == LineKind::kPipe) {
      int ends[2] = {-1, -1};
      EXPECT_EQ(pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
      EXPECT_GE(fcntl(ends[1], F_SETPIPE_SZ, 4096), 4096);
      reading = ends[0];
      writing = ends[1];
      return;
    }
    const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), small = 4096;
    setsockopt(listener, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener, 1), 0);
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    writing = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    setsockopt(writing, SOL_SOCKET, SO_SNDBUF, &small, sizeof small);
    EXPECT_EQ(connect(writing, reinterpret_cast<sockaddr*>(&address), size), 0);
    reading = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    fcntl(writing, F_SETFL, O_NONBLOCK);
    close(listener);
  }
  ~TestLine() {
    close(reading);
    if (writing >= 0) close(writing);
  }
  TestLine(const TestLine&) = delete;
  TestLine& operator=(const TestLine&) = delete;

  int reading = -1, writing = -1;
};

/// Reads a line and checks that it contains whole frames only.
class Reader {
 public:
  explicit Reader(int line) : line_(line) {}

  /// Reads up to `most` of the available bytes. Returns false if none are available.
  bool read_some(std::size_t most = 65536) {
    std::array<std::uint8_t, 65536> bytes;
    const ssize_t count = read(line_, bytes.data(), std::min(most, bytes.size()));
    if (count == 0) has_ended = true;
    if (count <= 0) return false;
    data_.insert(data_.end(), bytes.begin(), bytes.begin() + count);
    while (data_.size() >= kFrame) {
      note(std::span(data_).first(kFrame));
      data_.erase(data_.begin(), data_.begin() + kFrame);
    }
    return true;
  }
  bool is_between_frames() const { return data_.empty(); }
  /// Reads until `is_so` returns true, at most for `longest`. Returns the last value of `is_so`.
  template <class Is>
  bool until(Is is_so, Duration longest = std::chrono::seconds(20)) {
    const SteadyClock clock;
    for (const LocalTime end = clock.now() + longest; !is_so() && clock.now() < end && !has_ended;) {
      pollfd ready{line_, POLLIN, 0};
      poll(&ready, 1, 5);
      while (read_some()) {
      }
    }
    return is_so();
  }

  int zeros = 0;     ///< number of frames with zero force since the last frame with a force
  int silences = 0;  ///< number of times that the watchdog wrote a zero after a frame with a force
  int forces = 0, replies = 0;
  std::uint8_t last = kForce;  ///< kind of the last frame that is not a reply
  std::uint32_t releases_at_last_force = 0;
  bool is_whole = true;
  bool has_ended = false;

 private:
  void note(std::span<const std::uint8_t> frame) {
    const std::uint8_t kind = frame[1];
    is_whole = is_whole && frame[0] == kMagic && kind <= kOwnZero &&
               std::all_of(frame.begin() + 3, frame.end(), [kind](std::uint8_t byte) { return byte == kind; });
    if (kind == kForce) zeros = 0;
    if (kind == kZero && zeros++ == 0) ++silences;
    forces += kind == kForce ? 1 : 0;
    replies += kind == kReply ? 1 : 0;
    if (kind != kReply) last = kind;
    if (kind == kForce) releases_at_last_force = frame[2];
  }

  int line_;
  std::vector<std::uint8_t> data_;
};

}  // namespace tandem::devices

// Types of time. Only the outermost loops of the programs read a clock; all components receive the time as a parameter
// `LocalTime now`. Client and server have separate clocks. Their times have different types, so that they cannot be
// mixed. Converting between the two requires a measured offset (clock_sync.hpp).
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace tandem {

using Duration = std::chrono::nanoseconds;

/// Tag type that separates times of different clocks at compile time.
template <class Tag>
struct TaggedClock {
  using rep = Duration::rep;
  using period = Duration::period;
  using duration = Duration;
};
/// Time of the monotonic clock of this process.
using LocalTime = std::chrono::time_point<TaggedClock<struct LocalTag>, Duration>;
/// Time of the server's monotonic clock.
using ServerTime = std::chrono::time_point<TaggedClock<struct ServerTag>, Duration>;

constexpr double to_seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}
constexpr double to_milliseconds(Duration duration) {
  return 1e3 * to_seconds(duration);
}
constexpr Duration from_seconds(double seconds) {
  return Duration(static_cast<Duration::rep>(seconds * 1e9));
}

/// Converts local time to server time. This is valid only in the server, whose local clock defines server time.
constexpr ServerTime server_time_of_own_clock(LocalTime now) {
  return ServerTime(now.time_since_epoch());
}

/// Source of time for the outermost loops of the programs.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual LocalTime now() const noexcept = 0;
};

/// The monotonic clock CLOCK_BOOTTIME, which the absolute deadlines in realtime.hpp use, too. It continues while the
/// machine is suspended. A force that was received before a suspension is therefore recognised as old.
class SteadyClock final : public Clock {
 public:
  LocalTime now() const noexcept override {
    timespec time{};
    clock_gettime(CLOCK_BOOTTIME, &time);
    return LocalTime(std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec));
  }
};

/// A clock for tests and the lab; it changes only through advance_to().
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(LocalTime now = LocalTime{}) : now_(now) {}
  LocalTime now() const noexcept override { return now_; }
  void advance_to(LocalTime time) { now_ = time; }

 private:
  LocalTime now_;
};

}  // namespace tandem

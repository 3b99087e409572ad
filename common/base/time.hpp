// Types of time. Time is passed in, never fetched: components take `LocalTime now`, and only the programs' outermost
// loops read a clock. Client and server have separate clocks, hence two types; converting needs a measured offset
// (clock_sync.hpp).
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace tandem {

using Duration = std::chrono::nanoseconds;

/// Marks the clock that a time was read from.
template <class Tag>
struct TaggedClock {
  using rep = Duration::rep;
  using period = Duration::period;
  using duration = Duration;
};
/// Time of this process's own monotonic clock.
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

/// Converts on the server, whose own clock *is* server time; no other code may assume this.
constexpr ServerTime server_time_of_own_clock(LocalTime now) {
  return ServerTime(now.time_since_epoch());
}

/// Source of time for the programs' outermost loops.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual LocalTime now() const noexcept = 0;
};

/// CLOCK_BOOTTIME, the clock of the absolute deadlines in realtime.hpp: monotonic. It includes the time during which
/// the machine was suspended, so a force from before a suspension counts as old.
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

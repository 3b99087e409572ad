#include "devices/threaded_device.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "common/realtime/realtime.hpp"

namespace tandem::devices {
namespace {

constexpr Duration kMaxCommandAge = std::chrono::milliseconds(20);  // maximum age of a command, equal to SafetyChain's
// Number of zeros sent to the device at the end. More than one is needed, because the device may lose the last packets.
constexpr int kLastZeros = 3;
constexpr Duration kRetryPeriod = std::chrono::seconds(1);
constexpr Duration kWhileAbsent = std::chrono::milliseconds(5);
// Minimum duration of a step. It prevents a fast device from occupying a core at the priority of the haptic thread.
constexpr Duration kMinStep = std::chrono::microseconds(500);

bool is_zero(const Wrench& wrench) {
  return wrench.f.isZero(0) && wrench.t.isZero(0);
}

}  // namespace

bool Absence::is_attempt_due(LocalTime now) noexcept {
  if (now < next_attempt_) return false;
  next_attempt_ = now + kRetryPeriod;
  return true;
}

void Absence::begin(LocalTime now, std::string_view reason) noexcept {
  was_connected_ = true;
  reason_ = reason;
  next_attempt_ = now + kRetryPeriod;
}

void Absence::note_absence(std::string_view reason) noexcept {
  if (!was_connected_) reason_ = reason;
}

DeviceSample Absence::sample(LocalTime now) const noexcept {
  DeviceSample sample;
  sample.taken = now;
  sample.state = was_connected_ ? DeviceState::kLost : DeviceState::kOpening;
  sample.reason = reason_;
  return sample;
}

ThreadedDevice::ThreadedDevice(std::unique_ptr<DeviceDriver> driver, int realtime_priority,
                               std::shared_ptr<Watchdog> watchdog)
    : watchdog_(std::move(watchdog)), driver_(std::move(driver)), spec_(driver_->spec()) {
  thread_ = std::thread([this, realtime_priority] { run(realtime_priority); });
}

ThreadedDevice::~ThreadedDevice() {
  should_stop_.store(true, std::memory_order_relaxed);
  thread_.join();
}

DeviceSample ThreadedDevice::read(LocalTime /*now*/) noexcept {
  samples_.poll();
  return samples_.front();
}

bool ThreadedDevice::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  if (!is_finite(wrench_on_hand_D)) return false;
  commands_.publish({now, wrench_on_hand_D});
  return true;
}

bool ThreadedDevice::has_released_force() noexcept {
  const bool by_thread = gave_zero_.exchange(false, std::memory_order_acq_rel);
  return (watchdog_ && watchdog_->has_released_force()) || by_thread;
}

void ThreadedDevice::run(int realtime_priority) {
  // The result is ignored, because the haptic thread makes the same requests and reports those that were not granted.
  static_cast<void>(realtime::request_realtime(realtime_priority));
  while (!should_stop_.load(std::memory_order_relaxed)) {
    if (watchdog_) watchdog_->begin_command();
    step(newest_command(SteadyClock().now()));
  }
  for (int i = 0; i < kLastZeros; ++i) step(Wrench{});
}

void ThreadedDevice::step(const Wrench& wrench_on_hand_D) noexcept {
  const LocalTime now = SteadyClock().now();
  DeviceSample sample;
  note_may_be_on(now, driver_->may_be_on() || !is_zero(wrench_on_hand_D));
  const bool is_obsolete = watchdog_ && watchdog_->is_command_obsolete();
  try {
    sample = driver_->step(now, is_obsolete ? Wrench{} : wrench_on_hand_D);
  } catch (const std::exception&) {
    sample.state = DeviceState::kLost;
    sample.reason = "its driver failed for lack of memory or by an internal error; start again";
  }
  if (!driver_->may_be_on()) note_may_be_on(SteadyClock().now(), false);
  samples_.publish(sample);
  const bool is_absent = sample.state == DeviceState::kOpening || sample.state == DeviceState::kLost;
  std::this_thread::sleep_for((is_absent ? kWhileAbsent : kMinStep) - (SteadyClock().now() - now));
}

void ThreadedDevice::note_may_be_on(LocalTime now, bool may_be_on) noexcept {
  may_be_on_.store(may_be_on, std::memory_order_release);
  if (watchdog_) watchdog_->beat(now, may_be_on);
}

Wrench ThreadedDevice::newest_command(LocalTime now) noexcept {
  commands_.poll();
  const auto& [given, wrench_on_hand_D] = commands_.front();
  const bool is_stale = now - given > kMaxCommandAge;
  if (is_stale && !is_zero(wrench_on_hand_D)) gave_zero_.store(true, std::memory_order_release);
  return is_stale || gave_zero_.load(std::memory_order_acquire) ? Wrench{} : wrench_on_hand_D;
}

}  // namespace tandem::devices

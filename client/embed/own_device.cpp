#include "client/embed/own_device.hpp"

#include <cmath>

#include "devices/device_writer.hpp"

namespace tandem::client::embed {
namespace {

/// Largest accepted deviation of a quaternion's norm from 1. The error of a program that computes in single precision
/// is far smaller, about 1e-6.
constexpr double kMaxLengthError = 1e-2;

bool is_zero(const Wrench& wrench) noexcept {
  return wrench.f.isZero(0) && wrench.t.isZero(0);
}

devices::DeviceProfile checked(devices::DeviceProfile profile) {
  devices::check_device_spec(profile.spec);
  return profile;
}

}  // namespace

const char* problem_of(const FedSample& sample) noexcept {
  if (!is_finite(sample.X_DH)) return "the pose is not finite";
  if (sample.has_velocity && !is_finite(sample.V_DH)) return "the velocity is not finite";
  if (!(std::abs(sample.X_DH.q.norm() - 1) <= kMaxLengthError)) {
    return "the length of the rotation differs from 1 by more than 0.01; give a unit quaternion w, x, y, z";
  }
  return "";
}

OwnDevice::OwnDevice(devices::DeviceProfile profile)
    : profile_(checked(std::move(profile))),
      estimator_(profile_.spec.position_step_m, profile_.spec.rotation_step_rad) {}

void OwnDevice::feed(LocalTime now, const FedSample& fed) {
  devices::DeviceSample sample;
  sample.taken = now;
  sample.state = devices::DeviceState::kReady;
  sample.is_valid = true;
  sample.X_DH = {fed.X_DH.p, fed.X_DH.q.normalized()};
  sample.buttons = fed.buttons;
  const std::lock_guard lock(feeding_);
  const LocalTime before{Duration(fed_at_.load(std::memory_order_relaxed))};
  if (now - before > kMaxFeedAge) estimator_.reset();
  const Twist estimate = estimator_.add(now, sample.X_DH);
  sample.V_DH = fed.has_velocity ? fed.V_DH : estimate;
  samples_.publish(sample);
  fed_at_.store(now.time_since_epoch().count(), std::memory_order_release);
}

ForceCommand OwnDevice::force(LocalTime now) {
  const std::lock_guard lock(reading_);
  commands_.poll();
  const Command& newest = commands_.front();
  const LocalTime fed{Duration(fed_at_.load(std::memory_order_acquire))};
  const bool is_stale = now - newest.written > kZeroWithin || now - fed > kZeroWithin;
  if (is_stale && !is_zero(newest.on_hand_D)) gave_zero_.store(true, std::memory_order_release);
  ForceCommand command;
  command.commands = newest.number;
  command.is_stale = is_stale || gave_zero_.load(std::memory_order_acquire);
  if (!command.is_stale) command.on_hand_D = newest.on_hand_D;
  is_on_.store(!is_zero(command.on_hand_D), std::memory_order_release);
  return command;
}

// Returns the newest sample of the program. If the sample is older than kMaxFeedAge, it is marked invalid, so that the
// client decays the force. If it is older than kZeroWithin, the device is reported as lost, so that the client writes
// zero at once.
devices::DeviceSample OwnDevice::read(LocalTime now) noexcept {
  samples_.poll();
  devices::DeviceSample sample = samples_.front();
  if (fed_at_.load(std::memory_order_acquire) == kNever) {
    sample = {};
    sample.reason = "the program has fed no sample yet";
  } else if (has_ended_.load(std::memory_order_relaxed)) {
    sample.is_valid = false;
    sample.state = devices::DeviceState::kLost;
    sample.reason = "the program has closed it";
  } else if (now - sample.taken > kMaxFeedAge) {
    sample.is_valid = false;
    sample.reason = "the program has fed no sample for 10 ms; feed 200 to 2000 a second";
    if (now - sample.taken > kZeroWithin) sample.state = devices::DeviceState::kLost;
  }
  return sample;
}

bool OwnDevice::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  if (!is_finite(wrench_on_hand_D)) return false;
  commands_.publish({now, wrench_on_hand_D, ++command_count_});
  return true;
}

}  // namespace tandem::client::embed

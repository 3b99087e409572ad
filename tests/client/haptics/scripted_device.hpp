// A device whose pose the test sets. It stores the wrench that it receives.
#pragma once

#include <atomic>

#include "devices/device.hpp"

namespace tandem::client {

class ScriptedDevice final : public devices::Device {
 public:
  explicit ScriptedDevice(const Vec3& workspace_m = Vec3::Zero()) {
    spec_.name = "scripted";
    spec_.workspace_m = workspace_m;
    spec_.actuated_rotations = 3;
    spec_.force_maximum_n = {10.0, "this test"};
    spec_.torque_maximum_n_m = {1.0, "this test"};
    spec_.force_limit_n = 8.0;
    spec_.torque_limit_n_m = 0.5;
    sample.state = devices::DeviceState::kReady;
    sample.is_valid = true;
  }
  const devices::DeviceSpec& spec() const noexcept override { return spec_; }
  devices::DeviceSample read(LocalTime now) noexcept override {
    if (!has_frozen_clock) sample.taken = now;
    return sample;
  }
  bool write(LocalTime, const Wrench& wrench_on_hand_D) noexcept override {
    all_finite = all_finite && is_finite(wrench_on_hand_D);
    if (!accepts || (keeps_force && !last.f.isZero(0))) {
      ++refused;
      return false;
    }
    last = wrench_on_hand_D;
    return true;
  }

  devices::DeviceSample sample;   ///< result of the next read()
  Wrench last;                    ///< last accepted wrench
  bool has_frozen_clock = false;  ///< true: all samples keep the same time stamp
  bool all_finite = true;
  std::atomic<bool> accepts{true};       ///< if false, write() refuses
  std::atomic<bool> keeps_force{false};  ///< true: write() refuses after it has accepted a nonzero force
  std::atomic<int> refused{0};

 private:
  devices::DeviceSpec spec_;
};

}  // namespace tandem::client

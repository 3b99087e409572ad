#include "devices/replay/replay_device.hpp"

#include <algorithm>
#include <utility>

namespace tandem::devices {

ReplayDevice::ReplayDevice(DeviceSpec spec, std::shared_ptr<const std::vector<DeviceSample>> samples)
    : spec_(std::move(spec)), samples_(std::move(samples)) {
  if (!samples_->back().reason.empty()) ending_ = samples_->back().reason;
}

DeviceSample ReplayDevice::read(LocalTime now) noexcept {
  if (!std::exchange(is_start_set_, true)) started_ = now;
  const std::vector<DeviceSample>& samples = *samples_;
  const Duration path_time = now - started_;
  const LocalTime due = samples.front().taken + std::max(path_time, Duration(0));
  while (at_ + 1 < samples.size() && samples[at_ + 1].taken <= due) ++at_;
  DeviceSample sample = samples[at_];
  const bool is_over = at_ + 1 == samples.size() && due > sample.taken;
  if (!is_over && sample.is_valid && at_ + 1 < samples.size()) {
    const DeviceSample& next = samples[at_ + 1];
    const Duration gap = next.taken - sample.taken;
    if (next.is_valid && gap > Duration(0) && gap <= kMaxGap) {
      const double u = to_seconds(due - sample.taken) / to_seconds(gap);
      sample.X_DH.p += u * (next.X_DH.p - sample.X_DH.p);
      sample.X_DH.q = sample.X_DH.q.slerp(u, next.X_DH.q);
      sample.V_DH.v += u * (next.V_DH.v - sample.V_DH.v);
      sample.V_DH.w += u * (next.V_DH.w - sample.V_DH.w);
    }
  }
  sample.taken = now;
  sample.path_time = path_time;
  sample.reason = sample.is_valid ? "" : "as it was when it was recorded";
  if (is_over) {
    sample.state = DeviceState::kLost;
    sample.is_valid = false;
    sample.reason = ending_;
  }
  return sample;
}

void ReplayDevice::begin_path_at(LocalTime start) noexcept {
  is_start_set_ = true;
  started_ = start;
}

bool ReplayDevice::write(LocalTime /*now*/, const Wrench& /*wrench_on_hand_D*/) noexcept {
  return true;
}

}  // namespace tandem::devices

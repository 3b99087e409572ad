#include "devices/spacemouse/space_mouse.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <utility>

namespace tandem::devices {
namespace {

// Duration of one step of the driver, and time step of its filter.
constexpr Duration kStep = std::chrono::milliseconds(1);
constexpr Duration kReleased = std::chrono::milliseconds(150);
constexpr int kMaxReportsAStep = 16;
constexpr double kMaxMouseStep_s = 0.02;
constexpr double kFilter_rad_per_s = 60;
constexpr double kFullRate_m_per_s = 0.15, kFullRate_rad_per_s = 1.0;
constexpr double kFullPose_m = 0.04, kFullPose_rad = 0.5;
constexpr double kRoom_m = 0.2;
constexpr std::uint8_t kLightReport = 4;
constexpr std::string_view kMouseUnplugged = "it was unplugged; plug it in again";

DeviceSpec space_mouse_spec() {
  DeviceSpec spec;
  spec.name = "spacemouse";
  spec.actuated_translations = spec.actuated_rotations = 0;
  spec.force_limit_n = spec.torque_limit_n_m = 0;
  spec.reach_m = 2 * kRoom_m;
  return spec;
}

}  // namespace

SpaceMouseDriver::SpaceMouseDriver(CapControl control, OpenHid open, std::unique_ptr<HidPort> port)
    : spec_(space_mouse_spec()), control_(control), open_(std::move(open)), port_(std::move(port)) {
  if (port_) light(true);
}

SpaceMouseDriver::~SpaceMouseDriver() {
  if (port_) light(false);
}

DeviceSample SpaceMouseDriver::step(LocalTime now, const Wrench& /*wrench_on_hand_D*/) {
  if (!port_) return absent(now);
  absence_.end();
  if (!read_report(now)) {
    port_.reset();
    absence_.begin(now, kMouseUnplugged);
    return absent(now);
  }
  if (now - reported_ > kReleased) reports_.rest();
  move(now);
  DeviceSample sample;
  sample.taken = now;
  sample.state = DeviceState::kReady;
  sample.is_valid = true;
  sample.X_DH = X_DH_;
  sample.V_DH = V_DH_;
  sample.buttons = reports_.buttons();
  return sample;
}

// Returns a sample of the absent device. The handle keeps its pose; the buttons and the deflection of the cap are
// reset.
DeviceSample SpaceMouseDriver::absent(LocalTime now) {
  reports_ = {};
  cap_.setZero();
  cap_rate_.setZero();
  has_moved_ = false;
  if (absence_.is_attempt_due(now)) {
    std::string_view reason;
    port_ = open_(reason);
    if (port_) light(true);
    absence_.note_absence(port_ ? std::string_view() : reason);
  }
  return absence_.sample(now);
}

// Switches the light on or off. Some models accept "off" only after "on".
void SpaceMouseDriver::light(bool is_on) {
  const std::array<std::uint8_t, 2> on{kLightReport, 1}, off{kLightReport, 0};
  const bool is_taken = port_->write(on);
  if (!is_on && is_taken) port_->write(off);
}

/// Reads all reports that have arrived, and waits one step for the first one. Returns false if the device is
/// disconnected.
bool SpaceMouseDriver::read_report(LocalTime now) {
  std::array<std::uint8_t, 64> report{};
  for (int i = 0; i < kMaxReportsAStep; ++i) {
    const int length = port_->read(report, i == 0 ? kStep : Duration{0});
    if (length < 0) return false;
    if (length == 0) return true;
    const auto kind =
        reports_.parse(std::span(report).first(std::min(report.size(), static_cast<std::size_t>(length))));
    if (kind == SpaceMouseReports::Kind::kMotion) reported_ = now;
  }
  return true;
}

void SpaceMouseDriver::move(LocalTime now) {
  const double dt_s = has_moved_ ? std::min(to_seconds(now - moved_), kMaxMouseStep_s) : 0;
  has_moved_ = true;
  moved_ = now;
  if (dt_s <= 0) return;
  const double kept = std::exp(-kFilter_rad_per_s * dt_s);
  const Vec6 ahead = cap_ - reports_.deflection();
  const Vec6 c = cap_rate_ + kFilter_rad_per_s * ahead;
  cap_ = reports_.deflection() + (ahead + c * dt_s) * kept;
  cap_rate_ = (cap_rate_ - kFilter_rad_per_s * dt_s * c) * kept;
  const Pose next = next_pose(dt_s);
  V_DH_ = {(next.p - X_DH_.p) / dt_s, rotation_vector(next.q * X_DH_.q.conjugate()) / dt_s};
  X_DH_ = next;
}

Pose SpaceMouseDriver::next_pose(double dt_s) {
  if (control_ == CapControl::kPose)
    return {kFullPose_m * cap_.head<3>(), quaternion_of(kFullPose_rad * cap_.tail<3>())};
  Pose next = integrate(X_DH_, {kFullRate_m_per_s * cap_.head<3>(), kFullRate_rad_per_s * cap_.tail<3>()}, dt_s);
  next.p = next.p.cwiseMax(-kRoom_m).cwiseMin(kRoom_m);
  return next;
}

}  // namespace tandem::devices

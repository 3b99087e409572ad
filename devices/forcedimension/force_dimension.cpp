#include "devices/forcedimension/force_dimension.hpp"

#include <utility>

#include "common/base/buttons.hpp"

namespace tandem::devices {
namespace {

constexpr std::string_view kNotFound =
    "its maker's SDK finds no device; plug it in, switch it on, or check its permissions";

constexpr std::string_view kRefused =
    "its maker's SDK opens it, but refuses its watchdog or its force; start it by its maker's program, then start "
    "again";

/// Time of the watchdog in the device, in units of 125 µs: the largest possible value, about 32 ms. According to the
/// manufacturer, the device removes its force if it receives no new force within this time.
constexpr unsigned char kWatchdogUnits = 255;

// Converts a vector from the axes of the SDK to those of D.
Vec3 in_D_from_dhd(const Vec3& v) {
  return {v.y(), -v.x(), v.z()};
}
Vec3 dhd_from_D(const Vec3& v) {
  return {-v.y(), v.x(), v.z()};
}

/// Returns the orientation of the handle in D. `rows` is its rotation matrix in the axes of the SDK.
Quat orientation_D(const double (&rows)[3][3]) {
  Eigen::Matrix3d R, to_D;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = rows[i][j];
  }
  to_D << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  // `rows` may have single precision or a calibration error, so its product is no exact rotation and the quaternion
  // must be normalised.
  return Quat(Eigen::Matrix3d(to_D * R * to_D.transpose())).normalized();
}

}  // namespace

DhdFunctions dhd_functions(const std::filesystem::path& library, const std::string& setting) {
  VendorLibrary dhd("Force Dimension SDK", library, {"libdhd.so.3", "libdhd.so", "libdrd.so.3", "libdrd.so"}, setting);
  DhdFunctions found;
  dhd.find(found.open, "dhdOpen");
  dhd.find(found.close, "dhdClose");
  dhd.find(found.enable_force, "dhdEnableForce");
  dhd.find(found.get_pose, "dhdGetPositionAndOrientationFrame");
  dhd.find(found.set_force, "dhdSetForceAndTorque");
  dhd.find(found.get_button, "dhdGetButton");
  // dhdSetWatchdog exists since version 3.3.2 and is required: without it, a force would remain when the program is
  // killed
  dhd.find(found.set_watchdog, "dhdSetWatchdog");
  dhd.require_all();
  return found;
}

ForceDimensionDriver::ForceDimensionDriver(DeviceSpec spec, const DhdFunctions& dhd)
    : spec_(std::move(spec)), dhd_(dhd), velocity_(spec_.position_step_m, spec_.rotation_step_rad) {}

ForceDimensionDriver::~ForceDimensionDriver() {
  if (id_ >= 0) close();
}

/// Closes the device. Before, sets its force to zero, which has an effect only if the device still responds.
void ForceDimensionDriver::close() {
  show({});
  dhd_.enable_force(0, static_cast<char>(id_));
  dhd_.close(static_cast<char>(id_));
  id_ = -1;
}

bool ForceDimensionDriver::open(LocalTime now) {
  if (id_ >= 0) return true;
  if (!absence_.is_attempt_due(now)) return false;
  id_ = dhd_.open();
  if (id_ < 0) {
    absence_.note_absence(kNotFound);
    return false;
  }
  const auto id = static_cast<char>(id_);
  if (dhd_.set_watchdog(kWatchdogUnits, id) < 0 || dhd_.enable_force(1, id) < 0) {
    close();
    absence_.note_absence(kRefused);
    return false;
  }
  absence_.end();
  velocity_.reset();
  return true;
}

bool ForceDimensionDriver::show(const Wrench& wrench_on_hand_D) {
  const Vec3 f = dhd_from_D(wrench_on_hand_D.f), t = dhd_from_D(wrench_on_hand_D.t);
  const bool is_on = !f.isZero(0) || !t.isZero(0);
  may_be_on_ = may_be_on_ || is_on;
  const bool is_shown = dhd_.set_force(f.x(), f.y(), f.z(), t.x(), t.y(), t.z(), static_cast<char>(id_)) >= 0;
  if (is_shown) may_be_on_ = is_on;
  return is_shown;
}

DeviceSample ForceDimensionDriver::step(LocalTime now, const Wrench& wrench_on_hand_D) {
  if (!open(now)) return absence_.sample(now);
  Vec3 p;
  double rows[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto id = static_cast<char>(id_);
  if (dhd_.get_pose(&p.x(), &p.y(), &p.z(), rows, id) < 0 || !show(wrench_on_hand_D)) {
    close();
    absence_.begin(now, kSdkLost);
    return absence_.sample(now);
  }
  DeviceSample sample;
  sample.taken = now;
  sample.state = DeviceState::kReady;
  sample.is_valid = true;
  sample.X_DH = {in_D_from_dhd(p), orientation_D(rows)};
  sample.V_DH = velocity_.add(now, sample.X_DH);
  if (dhd_.get_button(0, id) > 0) sample.buttons |= kButtonGrab;
  if (dhd_.get_button(1, id) > 0) sample.buttons |= kButtonClutch;
  return sample;
}

}  // namespace tandem::devices

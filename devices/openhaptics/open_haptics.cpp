#include "devices/openhaptics/open_haptics.hpp"

#include <utility>

#include "common/base/buttons.hpp"

namespace tandem::devices {
namespace {

constexpr unsigned kInvalidDevice = 0xFFFFFFFF;
constexpr unsigned kButtons = 0x2000, kVelocity = 0x2051, kTransform = 0x2052, kForce = 0x2700, kForceOutput = 0x4000;
constexpr unsigned short kUsualPriority = 0x7fff;
constexpr unsigned kCallbackDone = 0;
constexpr double kMetre_mm = 1000;

constexpr std::string_view kSdkAbsent =
    "its maker's SDK finds no device; plug it in, and set it up by its maker's program";

Vec3 in_D_from_sdk(const Vec3& v) {
  return {v.x(), -v.z(), v.y()};
}
Vec3 sdk_from_D(const Vec3& v) {
  return {v.x(), v.z(), -v.y()};
}

Quat orientation_D(const double* transform) {
  Eigen::Matrix3d to_D;
  to_D << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix4d>(transform).topLeftCorner<3, 3>();
  return Quat(Eigen::Matrix3d(to_D * R * to_D.transpose())).normalized();
}

}  // namespace

HdFunctions hd_functions(const std::filesystem::path& library, const std::string& setting) {
  VendorLibrary hd("OpenHaptics SDK", library, {"libHD.so.3.4", "libHD.so.3", "libHD.so"}, setting);
  HdFunctions found;
  hd.find(found.init_device, "hdInitDevice");
  hd.find(found.disable_device, "hdDisableDevice");
  hd.find(found.make_current, "hdMakeCurrentDevice");
  hd.find(found.enable, "hdEnable");
  hd.find(found.start_scheduler, "hdStartScheduler");
  hd.find(found.stop_scheduler, "hdStopScheduler");
  hd.find(found.schedule, "hdScheduleSynchronous");
  hd.find(found.begin_frame, "hdBeginFrame");
  hd.find(found.end_frame, "hdEndFrame");
  hd.find(found.get_doubles, "hdGetDoublev");
  hd.find(found.get_integers, "hdGetIntegerv");
  hd.find(found.set_doubles, "hdSetDoublev");
  hd.find(found.get_error, "hdGetError");
  hd.require_all();
  return found;
}

OpenHapticsDriver::OpenHapticsDriver(DeviceSpec spec, const HdFunctions& hd) : spec_(std::move(spec)), hd_(hd) {
  spec_.actuated_rotations = 0;
}

OpenHapticsDriver::~OpenHapticsDriver() {
  if (is_open_) close();
}

bool OpenHapticsDriver::open(LocalTime now) {
  if (is_open_) return true;
  if (!absence_.is_attempt_due(now)) return false;
  const unsigned device = hd_.init_device(nullptr);
  if (hd_.get_error().code != 0 || device == kInvalidDevice) {
    absence_.note_absence(kSdkAbsent);
    return false;
  }
  frame_ = {};
  frame_.hd = &hd_;
  frame_.device = device;
  hd_.make_current(device);
  hd_.enable(kForceOutput);
  hd_.start_scheduler();
  absence_.end();
  is_open_ = true;
  return true;
}

/// Closes the device. Before, sets its force to zero, which has an effect only if the device still responds.
void OpenHapticsDriver::close() {
  run(Vec3::Zero());
  hd_.stop_scheduler();
  hd_.disable_device(frame_.device);
  is_open_ = false;
}

unsigned OpenHapticsDriver::exchange(void* data) {
  Frame& frame = *static_cast<Frame*>(data);
  const HdFunctions& hd = *frame.hd;
  hd.begin_frame(frame.device);
  hd.get_doubles(kTransform, frame.transform);
  hd.get_doubles(kVelocity, frame.velocity_mm_per_s);
  hd.get_integers(kButtons, &frame.buttons);
  hd.set_doubles(kForce, frame.force_n);
  hd.end_frame(frame.device);
  frame.is_good = hd.get_error().code == 0;
  return kCallbackDone;
}

bool OpenHapticsDriver::run(const Vec3& force_on_hand_D) {
  const Vec3 force = sdk_from_D(force_on_hand_D);
  for (int i = 0; i < 3; ++i) frame_.force_n[i] = force[i];
  frame_.is_good = false;
  may_be_on_ = may_be_on_ || !force.isZero(0);
  hd_.schedule(&OpenHapticsDriver::exchange, &frame_, kUsualPriority);
  if (frame_.is_good) may_be_on_ = !force.isZero(0);
  return frame_.is_good;
}

DeviceSample OpenHapticsDriver::step(LocalTime now, const Wrench& wrench_on_hand_D) {
  if (!open(now)) return absence_.sample(now);
  if (!run(wrench_on_hand_D.f)) {
    close();
    absence_.begin(now, kSdkLost);
    return absence_.sample(now);
  }
  DeviceSample sample;
  sample.taken = now;
  sample.state = DeviceState::kReady;
  sample.is_valid = true;
  const double* const at = frame_.transform + 12;
  const double* const v = frame_.velocity_mm_per_s;
  sample.X_DH = {in_D_from_sdk(Vec3(at[0], at[1], at[2])) / kMetre_mm, orientation_D(frame_.transform)};
  sample.V_DH.v = in_D_from_sdk(Vec3(v[0], v[1], v[2])) / kMetre_mm;
  if ((frame_.buttons & 1) != 0) sample.buttons |= kButtonGrab;
  if ((frame_.buttons & 2) != 0) sample.buttons |= kButtonClutch;
  return sample;
}

}  // namespace tandem::devices

// Interface of a haptic device: it returns one sample per read, accepts one command per write, and has limits with
// sources.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/buttons.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// A number and its source: a data sheet, a measurement, or "unverified: …" with an explanation.
struct SourcedLimit {
  double value = 0;
  std::string source;

  bool operator==(const SourcedLimit&) const = default;
};

/// Returns whether the value is finite and has a source that does not begin with "unverified". Upper or lower case and
/// leading white space do not matter. An unverified maximum can lower a limit, but never raise it. An unverified mass,
/// damping or step is used because no better value is known.
bool is_verified(const SourcedLimit& limit) noexcept;

/// Capabilities and limits of a device.
struct DeviceSpec {
  std::string name;
  int sensed_translations = 3;
  int sensed_rotations = 3;                             ///< number of measured rotations; 0: constant orientation
  int actuated_translations = 3;                        ///< number of force axes; 0: no force
  int actuated_rotations = 0;                           ///< number of torque axes; 0: no torque
  std::uint32_t buttons = kButtonGrab | kButtonClutch;  ///< bits of Button that the device can set
  SourcedLimit force_maximum_n;  ///< maximum stated by the manufacturer; bounds the software limit if it is verified
  SourcedLimit torque_maximum_n_m;
  double force_limit_n = 2.0;  ///< software limit, ≤ force_maximum_n; the default is suitable for unverified devices
  double torque_limit_n_m = 0.1;
  Vec3 workspace_m = Vec3::Zero();  ///< width of the reachable space around the origin of D; zero: unknown or unlimited
  /// Maximum distance of the handle from the origin of D, with a margin; a sample beyond it is a fault
  double reach_m = 2.0;
  /// Speed limit of the handle. Above it, a fault sets the force to zero within 20 ms, until the device is re-armed.
  double speed_limit_m_per_s = 3.0;
  double slew_limit_n_per_s = 4000.0;  ///< maximum rate of change of the displayed force
  double slew_limit_n_m_per_s = 200.0;
  double position_step_m = 0;  ///< resolution of the reported pose; 0: exact
  double rotation_step_rad = 0;

  bool has_force() const { return actuated_translations > 0; }
  bool has_torque() const { return actuated_rotations > 0; }
};

/// Life cycle of a device. It is opened, moved to the reference position of its encoders (homing), and is then ready.
/// It is lost when it no longer responds. Only a ready device displays a force.
enum class DeviceState : std::uint8_t { kOpening, kHoming, kReady, kLost };
/// Returns the name of a state: "opening", "homing", "ready" or "lost".
std::string_view name_of(DeviceState state) noexcept;

/// State of the hand at one instant, in the device's base frame D.
struct DeviceSample {
  LocalTime taken{};
  DeviceState state = DeviceState::kOpening;
  std::string_view reason;  ///< why the device is not ready, with the remedy; points to a string literal
  bool is_valid = false;    ///< true only if the device is ready; otherwise the fields below must not be used
  Pose X_DH;
  Twist V_DH;
  std::uint32_t buttons = 0;  ///< bits of Button
  /// Time on the path of a simulated or recorded hand, negative before the start of the path; otherwise 0
  Duration path_time{0};
};

/// Returns a readable state, e.g. "ready" or "lost: it was unplugged; plug it in again".
std::string describe(const DeviceSample& sample);

/// A haptic device, which devices/registry.hpp opens and the destructor closes. Implementations of read() and write()
/// neither sleep nor allocate, and they block at most for the time of one transfer. Homing and reopening proceed in
/// steps, one at each read().
///
/// Thread  haptic (any thread for opening before and closing after)
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  virtual DeviceSample read(LocalTime now) noexcept = 0;
  /// Sets the wrench on the hand, expressed in D, with the torque about the handle's origin. Only DeviceWriter, which
  /// clamps the wrench, may call this function. Returns false if the command was not delivered.
  virtual bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept = 0;
  /// Sets the start time of a simulated or recorded path; before it the hand rests at the beginning of the path. The
  /// time can be changed until the path has started. Without a call, the path begins at the first read(). Real devices
  /// ignore the call.
  virtual void begin_path_at(LocalTime /*start*/) noexcept {}
  /// Returns true if a watchdog has written zero since the last call, because this program was stopped. The device then
  /// displays zero although write() requested a force.
  virtual bool has_released_force() noexcept { return false; }
  /// Returns whether the device may still display a force although write() accepted zero: zero is in transit or was not
  /// delivered.
  virtual bool may_be_on() const noexcept { return false; }
};

}  // namespace tandem::devices

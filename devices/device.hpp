// Interface of a haptic device: one sample per read, one command per write, limits with sources.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/buttons.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// A number and its source: a data sheet, a measurement, or "unverified: …".
struct SourcedLimit {
  double value = 0;
  std::string source;

  bool operator==(const SourcedLimit&) const = default;
};

/// False for a source that is empty or begins with "unverified", in any case and after any blanks. Such a maximum can
/// lower a limit, never raise it; such a mass, damping or step is used for want of a better value.
bool is_verified(const SourcedLimit& limit) noexcept;

/// Capabilities and limits of a device.
struct DeviceSpec {
  std::string name;
  int sensed_translations = 3;
  int sensed_rotations = 3;                             ///< 0: the handle's orientation is constant
  int actuated_translations = 3;                        ///< 0: no force
  int actuated_rotations = 0;                           ///< 0: no torque
  std::uint32_t buttons = kButtonGrab | kButtonClutch;  ///< bits of Button that the device has
  SourcedLimit force_maximum_n;                         ///< the maker's; bounds the software limit when verified
  SourcedLimit torque_maximum_n_m;
  double force_limit_n = 2.0;  ///< software limit, ≤ force_maximum_n; the default is for unverified devices
  double torque_limit_n_m = 0.1;
  Vec3 workspace_m = Vec3::Zero();  ///< width of the reachable space about D's origin; zero: unknown or unlimited
  double reach_m = 2.0;  ///< maximum distance of the handle from D's origin, with margin; a farther sample is a fault
  double speed_limit_m_per_s = 3.0;    ///< a faster handle is a fault: force to zero within 20 ms, then re-armed
  double slew_limit_n_per_s = 4000.0;  ///< maximum rate of change of the displayed force
  double slew_limit_n_m_per_s = 200.0;
  double position_step_m = 0;  ///< resolution of the reported pose; 0: exact
  double rotation_step_rad = 0;

  bool has_force() const { return actuated_translations > 0; }
  bool has_torque() const { return actuated_rotations > 0; }
};

/// Life cycle of a device: it is opened, moved to the reference of its encoders, ready, and lost when it no longer
/// responds. Only a ready device shows a force.
enum class DeviceState : std::uint8_t { kOpening, kHoming, kReady, kLost };
/// Name of a state: "opening", "homing", "ready", "lost".
std::string_view name_of(DeviceState state) noexcept;

/// State of the hand at one instant, in the device base frame D.
struct DeviceSample {
  LocalTime taken{};
  DeviceState state = DeviceState::kOpening;
  std::string_view reason;  ///< why the device is not ready, with the remedy; a literal
  bool is_valid = false;    ///< true only when ready; if false, do not use the fields below
  Pose X_DH;
  Twist V_DH;
  std::uint32_t buttons = 0;  ///< bits of Button
  Duration path_time{0};      ///< time on the path of a simulated or recorded hand, negative before its start; else 0
};

/// Readable state, e.g. "ready"; "lost: it was unplugged; plug it in again".
std::string describe(const DeviceSample& sample);

/// A haptic device, opened by devices/registry.hpp and closed by its destructor. Implementations of read() and write()
/// do not block longer than a read takes, do not sleep and do not allocate. Homing and reopening proceed in steps
/// during read().
///
/// Thread  haptic (open and close: any, before and after)
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  virtual DeviceSample read(LocalTime now) noexcept = 0;
  /// Sets the wrench on the hand, in D, with torque about the handle's origin. Only DeviceWriter calls it, which
  /// clamps. Returns false if the command was not delivered.
  virtual bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept = 0;
  /// Sets the start time of a simulated or recorded path; until then the hand rests at its beginning. The time may be
  /// changed until the start. A real hand ignores it. Without a call, the path begins at the first read().
  virtual void begin_path_at(LocalTime /*start*/) noexcept {}
  /// True if the force was zero since the last call despite write(): a watchdog wrote zero while this program was
  /// stopped.
  virtual bool has_released_force() noexcept { return false; }
  /// The device may still show a force although write() accepted zero: zero is in transit, or could not be delivered.
  virtual bool may_be_on() const noexcept { return false; }
};

}  // namespace tandem::devices

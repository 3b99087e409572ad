// Interface of a haptic device. Each read returns one sample, each write sets one force. The device also states its
// limits, with the source of each.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/buttons.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// A number and its source: a data sheet, a measurement, or a text "unverified: …" with an explanation.
struct SourcedLimit {
  double value = 0;
  std::string source;

  bool operator==(const SourcedLimit&) const = default;
};

/// Returns whether the value is finite and has a source that does not begin with "unverified". The comparison ignores
/// case and leading white space. Use of unverified values:
/// * A maximum (of force, torque or stiffness) may lower a limit, but never raises it.
/// * A mass, a damping or a resolution is used as it is, because no better value is known.
bool is_verified(const SourcedLimit& limit) noexcept;

/// Capabilities and limits of a device.
struct DeviceSpec {
  std::string name;
  int sensed_translations = 3;
  int sensed_rotations = 3;                             ///< number of measured rotation axes; 0: fixed orientation
  int actuated_translations = 3;                        ///< number of force axes; 0: no force
  int actuated_rotations = 0;                           ///< number of torque axes; 0: no torque
  std::uint32_t buttons = kButtonGrab | kButtonClutch;  ///< bits of Button that the device can set
  SourcedLimit force_maximum_n;  ///< maximum by the manufacturer; if verified, it bounds force_limit_n
  SourcedLimit torque_maximum_n_m;
  /// Software limit of the force, ≤ force_maximum_n. The default is also permitted if the maximum is unverified.
  double force_limit_n = 2.0;
  double torque_limit_n_m = 0.1;
  /// Width of the reachable space around the origin of D [m]; zero: unknown or unlimited
  Vec3 workspace_m = Vec3::Zero();
  /// Maximum distance of the handle from the origin of D [m], including a margin. A sample farther away counts as a
  /// fault.
  double reach_m = 2.0;
  /// Speed limit of the handle. Above this speed the force falls to zero within 20 ms. It remains zero until the user
  /// arms the force again.
  double speed_limit_m_per_s = 3.0;
  double slew_limit_n_per_s = 4000.0;  ///< maximum rate of change of the displayed force
  double slew_limit_n_m_per_s = 200.0;
  double position_step_m = 0;  ///< resolution of the reported pose; 0: exact
  double rotation_step_rad = 0;

  bool has_force() const { return actuated_translations > 0; }
  bool has_torque() const { return actuated_rotations > 0; }
};

/// Life cycle of a device: it is opened, moved to the reference position of its encoders (homing), and is then ready. It
/// is lost when it no longer responds. Only a ready device displays a force.
enum class DeviceState : std::uint8_t { kOpening, kHoming, kReady, kLost };
/// Returns the name of a state: "opening", "homing", "ready" or "lost".
std::string_view name_of(DeviceState state) noexcept;

/// State of the hand at one instant, in the device's base frame D.
struct DeviceSample {
  LocalTime taken{};
  DeviceState state = DeviceState::kOpening;
  std::string_view reason;  ///< why the device is not ready, with the remedy; refers to a string literal
  bool is_valid = false;    ///< true only if the device is ready; if false, the fields below are meaningless
  Pose X_DH;
  Twist V_DH;
  std::uint32_t buttons = 0;  ///< pressed buttons, as bits of Button
  /// Time since the start of the path of a simulated or recorded hand, negative before the start; 0 for other devices.
  Duration path_time{0};
};

/// Returns the state as readable text, e.g. "ready" or "lost: it was unplugged; plug it in again".
std::string describe(const DeviceSample& sample);

/// A haptic device. open_device() in devices/registry.hpp opens it; the destructor closes it. Implementations of read()
/// and write() neither sleep nor allocate, and block at most for the duration of one transfer. Homing and reopening are
/// divided into short steps, of which each read() executes one.
///
/// Thread  haptic; any thread may construct and destroy the device
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  virtual DeviceSample read(LocalTime now) noexcept = 0;
  /// Sets the wrench on the hand, expressed in D, with the torque about the handle's origin. Only DeviceWriter may call
  /// this function, because it clamps the wrench. Returns false if the command was not delivered.
  virtual bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept = 0;
  /// Sets the start time of a simulated or recorded path. Before this time the hand rests at the beginning of the path.
  /// The caller may change the time until the path has started. Without any call, the path starts at the first read().
  /// Real devices ignore the call.
  virtual void begin_path_at(LocalTime /*start*/) noexcept {}
  /// Returns whether a watchdog has written zero since the last call. It does so if this program was stopped for some
  /// time. The device then displays zero, whatever force write() has set.
  virtual bool has_released_force() noexcept { return false; }
  /// Returns whether the device may still display a force although write() has accepted a zero: this zero may be in
  /// transit, or may not have been delivered.
  virtual bool may_be_on() const noexcept { return false; }
};

}  // namespace tandem::devices

// What a haptic device is to this project: one sample read at once, one command out, limits with sources.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/buttons.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// A number and where it comes from: a data sheet, a measurement, or "unverified: …".
struct SourcedLimit {
  double value = 0;
  std::string source;

  bool operator==(const SourcedLimit&) const = default;
};

/// False for a source that is empty or begins with "unverified", in any case and after any blanks. Such a maximum can
/// lower what is allowed, never raise it; such a mass, damping or step is used, as nothing better is known.
bool is_verified(const SourcedLimit& limit) noexcept;

/// What a device can do, and what we let it do.
struct DeviceSpec {
  std::string name;
  int sensed_translations = 3;
  int sensed_rotations = 3;                             ///< 0: the handle's orientation stays as it is
  int actuated_translations = 3;                        ///< 0: no force
  int actuated_rotations = 0;                           ///< 0: no torque
  std::uint32_t buttons = kButtonGrab | kButtonClutch;  ///< bits of Button: those that it has
  SourcedLimit force_maximum_n;  ///< of the maker; describes, and bounds the software limit when verified
  SourcedLimit torque_maximum_n_m;
  double force_limit_n = 2.0;  ///< software limit, ≤ force_maximum_n; the default is for unverified devices
  double torque_limit_n_m = 0.1;
  Vec3 workspace_m =
      Vec3::Zero();      ///< widths of what the handle reaches about D's origin; zero: not known, or no limits
  double reach_m = 2.0;  ///< of the handle from D's origin, with margin: beyond, a sample is a fault
  double speed_limit_m_per_s = 3.0;    ///< a faster handle is a fault: force to zero within 20 ms, then re-armed
  double slew_limit_n_per_s = 4000.0;  ///< how fast the displayed force may change
  double slew_limit_n_m_per_s = 200.0;
  double position_step_m = 0;  ///< resolution of the reported pose; 0: exact
  double rotation_step_rad = 0;

  bool has_force() const { return actuated_translations > 0; }
  bool has_torque() const { return actuated_rotations > 0; }
};

/// What becomes of a device: it is opened, moved to where its encoders know their zero, ready, and lost when it no
/// longer answers. Only a device that is ready shows a force.
enum class DeviceState : std::uint8_t { kOpening, kHoming, kReady, kLost };
/// "opening", "homing", "ready", "lost".
std::string_view name_of(DeviceState state) noexcept;

/// Everything about the hand at one instant, in the device base frame D.
struct DeviceSample {
  LocalTime taken{};
  DeviceState state = DeviceState::kOpening;
  std::string_view reason;  ///< why it is not ready, and what would help: a literal
  bool is_valid = false;    ///< false, as unless ready: do not use the rest
  Pose X_DH;
  Twist V_DH;
  std::uint32_t buttons = 0;  ///< bits of Button
  Duration path_time{0};      ///< of a simulated or recorded hand: time on its path, negative before its start; else 0
};

/// "ready"; "lost: it was unplugged; plug it in again"; "ready, but gives no usable samples: its …".
std::string describe(const DeviceSample& sample);

/// A haptic device, opened by devices/registry.hpp and closed by its destructor. Implementations do not block longer
/// than a read takes, do not sleep, and do not allocate in read() and write(). Homing and opening again what was lost
/// go on in steps behind read().
///
/// Thread  haptic (open and close: any, before and after)
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  virtual DeviceSample read(LocalTime now) noexcept = 0;
  /// What to display on the hand, in D, torque about the handle's origin. Called only by DeviceWriter, which clamps.
  /// False: the command was not delivered.
  virtual bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept = 0;
  /// A simulated or recorded hand rests where its path begins until `start`, which may be called again until then with
  /// another time. A hand of a person ignores it. Without a call, the path begins at the first read().
  virtual void begin_path_at(LocalTime /*start*/) noexcept {}
  /// Since the last call the hand was let go, whatever was written: a watchdog wrote zero while this program was stopped.
  virtual bool has_let_go() noexcept { return false; }
  /// The device may still show a force although write() has taken zero: zero is on its way, or could not be delivered.
  virtual bool may_be_on() const noexcept { return false; }
};

}  // namespace tandem::devices

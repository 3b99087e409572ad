// What a haptic device is to this project: one sample read at once, one command out, limits with sources.
#pragma once

#include <cstdint>
#include <string>

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
  int force_axes = 3;            ///< 3, or 6 with torque
  SourcedLimit force_maximum_n;  ///< of the maker; describes, and bounds the software limit when verified
  SourcedLimit torque_maximum_n_m;
  double force_limit_n = 2.0;  ///< software limit, ≤ force_maximum_n; the default is for unverified devices
  double torque_limit_n_m = 0.1;
  double speed_limit_m_per_s = 3.0;    ///< a faster handle is a fault: force to zero within 20 ms, then re-armed
  double slew_limit_n_per_s = 4000.0;  ///< how fast the displayed force may change
  double slew_limit_n_m_per_s = 200.0;
};

/// Everything about the hand at one instant, in the device base frame D.
struct DeviceSample {
  LocalTime taken{};
  bool is_valid = false;  ///< false: do not use the rest
  Pose X_DH;
  Twist V_DH;
  std::uint32_t buttons = 0;  ///< bits of Button (proto/state.hpp gives them meaning)
};

/// What the device shall display on the hand, in D, torque about the handle's origin.
struct DeviceCommand {
  Wrench wrench_on_hand_D;
};

/// A haptic device. Implementations do not block longer than a read takes, do not sleep, and do not allocate
/// in read() and write().
///
/// Thread  haptic (open and close: any, before and after)
class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceSpec& spec() const noexcept = 0;
  virtual DeviceSample read(LocalTime now) noexcept = 0;
  /// Called only by DeviceWriter, which clamps. False: the command was not delivered.
  virtual bool write(LocalTime now, const DeviceCommand& command) noexcept = 0;
};

}  // namespace tandem::devices

// Output of the haptic path: writes the computed wrench to the device, and sums the work of the displayed wrench.
//
//   wrench of the scene ──┐
//   border and nudge ─────┴─▶ requested ─▶ ramp and decay, slew limit, finite check ─▶ clamp and write ─▶ displayed
#pragma once

#include <cstdint>

#include "client/haptics/port_work.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device_writer.hpp"

namespace tandem::client {

/// Displays wrenches on the device. All wrenches are about the handle, in the frame D of the device's base.
///
/// Invariants  Every wrench passes the safety chain and the clamp. If the device refuses a command, the device still
///             displays the previous command, and the work of that command is summed. After a refusal the force is
///             ramped up from zero
class ForceOutput {
 public:
  /// In      safety  slew and speed limits are taken from the device's spec
  ///         device  must outlive this
  /// Fails   std::invalid_argument: bad safety settings, or device limits that DeviceWriter refuses
  ForceOutput(const haptics::SafetySettings& safety, devices::Device& device);

  /// Ends a period with the handle at `X_DH`, and sums the work of the wrench that was displayed during the period.
  void move_to(const Pose& X_DH) noexcept { work_.move_to(X_DH); }
  /// Must be called if the handle's pose is unknown. The motion of the handle until the next move_to() then adds no
  /// work.
  void lose_pose() noexcept { work_.lose_pose(); }

  /// Displays the scene's wrench plus `own_on_hand_D`, the client's own force (border and nudge).
  /// In      conditions  input of the safety chain; its wrench is ignored
  ///         is_ready    false: the device is not ready, and zero is written instead
  void write(LocalTime now, const Wrench& scene_on_hand_D, const Vec3& own_on_hand_D, haptics::SafetyInput conditions,
             bool is_ready) noexcept;
  /// Writes a zero wrench. Returns false if the device has not accepted the command.
  bool write_zero(LocalTime now) noexcept;
  /// Reduces the force to zero, then ramps it up again, for example after a change of the scene.
  void rearm() noexcept { safety_.rearm(); }
  /// Ramps the force to zero from the next write() on.
  void begin_shutdown() noexcept { safety_.begin_shutdown(); }
  /// Returns true if no force is displayed, and no force will be displayed before the next ramp begins.
  bool is_quiet() const noexcept { return safety_.is_quiet(); }

  /// Returns the last command that the device accepted.
  const Wrench& displayed_D() const noexcept { return writer_.written(); }
  /// Returns the part of displayed_D() that comes from the scene, without border and nudge.
  Wrench displayed_of_scene_D() const noexcept;
  bool was_clamped() const noexcept { return writer_.was_clamped(); }
  haptics::SafetyFaults faults() const noexcept { return safety_.faults(); }
  std::uint64_t write_failures() const noexcept { return write_failures_; }
  /// Returns the work of the displayed wrench [device J].
  const PortWork& work() const noexcept { return work_; }

 private:
  bool display(LocalTime now, const Wrench& on_hand_D) noexcept;

  devices::DeviceWriter writer_;
  haptics::SafetyChain safety_;
  PortWork work_;
  Wrench requested_D_;                ///< sum of the forces of scene, border and nudge, before the safety chain
  Vec3 own_D_ = Vec3::Zero();         ///< the part of requested_D_ that the client adds: forces of border and nudge
  std::uint64_t write_failures_ = 0;  ///< number of commands that the device refused
};

}  // namespace tandem::client

// Input of the haptic path: computes the handle's pose and twist in the world from a sample of the device.
//
//   device ─▶ reader ─▶ sample ─┬─▶ workspace mapping, border ─▶ clutch ─▶ handle in W        (the tool follows it)
//                               └─▶ encoder path ─▶ mapping ─▶ clutch ─▶ path of the handle   (work is summed along it)
#pragma once

#include "client/haptics/clutch.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "common/haptics/encoder_path.hpp"
#include "devices/device_reader.hpp"

namespace tandem::client {

/// Conditions on which the motion of the device's base in one tick depends.
struct HandConditions {
  double period_s = 0.001;
  bool has_scene = false;               ///< true: the scene can be rendered
  bool is_displaying = false;           ///< true: the scene's force may be displayed
  bool is_quiet = false;                ///< true: no force is displayed at present (SafetyChain::is_quiet())
  Vec3 scene_on_hand_D = Vec3::Zero();  ///< displayed force of the scene [N]
};

/// Reads the device and computes the handle's motion in the world.
///
/// Invariants  While samples are invalid, handle_W() and path_W() keep their last values. While is_clutched(), both are
///             frozen. A requested mapping is applied only while no force is displayed and is_clutched() is true. So
///             neither the force nor the tool jumps
/// Thread      haptic: no allocation, no throw
class HandInput {
 public:
  /// In      device      must outlive this
  ///         has_border  true: rate control and a soft wall at the border of the device's workspace
  HandInput(devices::Device& device, bool has_border);

  /// Starts a new scene: places the device's base as the scene's mapping says, and resets the offset of the clutch.
  void enter(const WorkspaceMapping& scene) noexcept;
  /// Requests a changed mapping of the same scene.
  void change(const WorkspaceMapping& scene) noexcept { workspace_.change(scene); }

  /// Reads a sample and computes the handle's speed. Must be called once a tick, before move().
  void read(LocalTime now) noexcept;
  /// Moves handle and base for one period. Returns true if a requested mapping was applied, so that the handle has
  /// jumped.
  bool move(const HandConditions& conditions) noexcept;

  /// Returns the sample of this tick.
  const devices::DeviceSample& sample() const noexcept { return sample_; }
  /// Returns the larger of the reported speed and the speed between two samples [m/s]; 0 for an invalid sample.
  double speed_m_per_s() const noexcept { return speed_m_per_s_; }
  /// Returns true if the clutch is pressed, or if a requested mapping waits for the force to fade out.
  bool is_clutched() const noexcept;
  const WorkspaceMapping& mapping() const noexcept { return workspace_.mapping(); }
  /// Returns the force of the border [N], in D.
  const Vec3& wall_on_hand_D() const noexcept { return workspace_.wall_on_hand_D(); }

  /// Returns pose and twist of the handle in the world. The tool follows them, so the clutch is included.
  const RigidState& handle_W() const noexcept { return handle_W_; }
  /// Poses of the handle with smoothed encoder steps, for the computation of work:
  /// * path_D(): in the device's base
  /// * unclutched_path_W(): in the world, without the offset of the clutch
  /// * path_W(): in the world, with the offset of the clutch
  const Pose& path_D() const noexcept { return X_DH_path_; }
  const Pose& unclutched_path_W() const noexcept { return raw_X_WH_; }
  const Pose& path_W() const noexcept { return X_WH_path_; }

 private:
  double speed_to(const devices::DeviceSample& sample) const noexcept;
  bool apply_requested_mapping(bool is_quiet) noexcept;
  void move_base(const HandConditions& conditions) noexcept;
  void move_handle() noexcept;

  devices::DeviceReader reader_;
  devices::DeviceSample sample_;  ///< sample of this tick; may be invalid
  double speed_m_per_s_ = 0;
  haptics::EncoderPath device_path_;
  HandWorkspace workspace_;
  Clutch clutch_;
  RigidState handle_W_;
  Pose X_DH_path_;
  Pose raw_X_WH_;
  Pose X_WH_path_;
};

}  // namespace tandem::client

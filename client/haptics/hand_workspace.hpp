// Mapping of the device's small workspace into the large scene, with the user's scale and rotation. While the handle is
// beyond the border of the device's workspace, the mapped device base moves through the scene (rate control).
#pragma once

#include "common/base/workspace.hpp"
#include "devices/device.hpp"

namespace tandem::client {

/// Adjustments of the scene's mapping by the user.
struct WorkspaceSettings {
  double scale = 1;     ///< user's factor on the scene's position scale, > 0
  double turn_rad = 0;  ///< rotation of the device's base about the vertical [rad], to match the user's seat and view
};

/// Applies the user's scale and rotation to the scene's mapping. The user's scale multiplies force and position
/// equally, so the ratio of device power f_D · v_D to world power f_W · v_W remains a constant of the scene.
WorkspaceMapping with_user(WorkspaceMapping scene, const WorkspaceSettings& user) noexcept;

/// The workspace mapping in use, with rate control beyond the border.
///
/// Model   The border is a box of 0.8 × the device's workspace about D's origin. d is the depth of the handle beyond
///         the border on each axis, limited to d_max = 0.1 × the width of the workspace. Within the box the hand moves
///         the tool. Beyond the border, two effects are added:
///         1. The base moves with v = s_p · (1 width per second) · (d / d_max)², where s_p is the position scale.
///         2. A spring pushes the hand back with F = −F_wall · d / d_max. F_wall is a quarter of the device's force
///            limit, at most 2 N. Both v and F are zero at the border.
///         Three limits apply to the motion of the base:
///         1. Force: if the scene's force opposes the motion, the base slows down. It stops at half the device's force
///            limit, so that the force cannot increase further.
///         2. Travel: in one excursion beyond the border, the base moves at most L = 3 × the largest width (in the
///            device's metres). For this, v is multiplied by min(1, (L − travel) / 0.2 L). So the base stops if the
///            handle is left beyond the border. The travel is reset once the handle is within 0.7 of the workspace.
///         3. Power: the motion of the base against the scene's force does work that the hand does not supply. Its
///            power is at most F_limit / 2 · width/s (0.2 W for a device of 0.1 m and 4 N), and its energy per
///            excursion at most F_limit / 2 · L. The energy limits count this work as supplied by the hand.
/// Source  Dominjon, Lécuyer, Burkhardt, Andrade-Barroso, Richir, "The 'Bubble' technique: interacting with large
///         virtual environments using haptic devices with limited workspace", World Haptics 2005: position control
///         inside the border, rate control and a spring outside. Differences: the paper uses a sphere and a cubic law,
///         and does not limit force or travel.
/// Thread  haptic: no allocation, no throw
class HandWorkspace {
 public:
  /// In      device      specification of the device; its workspace determines the border. If the workspace is
  ///                     unknown, there is no border
  ///         has_border  false: there is no border
  HandWorkspace(const devices::DeviceSpec& device, bool has_border) noexcept;

  /// Starts a new scene, with the base at the pose given by the scene's mapping.
  void enter(const WorkspaceMapping& scene) noexcept;
  /// Requests a changed mapping of the same scene. The caller must call apply_change() while the clutch freezes the
  /// tool and no force is displayed.
  void change(const WorkspaceMapping& scene) noexcept;
  bool is_changing() const noexcept { return is_changing_; }
  void apply_change() noexcept;

  /// Moves the base for one period by rate control, and computes the force of the border.
  /// In      p_DH  position of the handle; scene_on_hand_D  force of the scene on the hand
  void advance(const Vec3& p_DH, const Vec3& scene_on_hand_D, double period_s) noexcept;
  /// Stops the base and removes the force of the border until the handle has returned within the border. So the base
  /// does not move if the handle starts beyond the border, or if the user releases the clutch there.
  void rest() noexcept;

  const WorkspaceMapping& mapping() const noexcept { return mapping_; }
  /// Returns the velocity of the base in the world [m/s].
  const Vec3& rate_W() const noexcept { return rate_W_; }
  /// Returns the force of the border [N], in D.
  const Vec3& wall_on_hand_D() const noexcept { return wall_on_hand_D_; }

 private:
  void stop() noexcept;

  Vec3 half_ = Vec3::Zero();  ///< half the device's workspace [m]; zero: no border
  double force_limit_n_ = 0;
  WorkspaceMapping scene_;
  WorkspaceMapping mapping_;
  bool is_changing_ = false;
  bool was_within_ = false;
  double travelled_m_ = 0;  ///< distance that the base has moved in the current excursion, in the device's metres
  Vec3 rate_W_ = Vec3::Zero();
  Vec3 wall_on_hand_D_ = Vec3::Zero();
};

}  // namespace tandem::client

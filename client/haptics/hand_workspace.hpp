// Mapping of the device's small workspace into the large scene, and the user's changes of it. Beyond the border of the
// device's workspace the device's base moves through the scene.
#pragma once

#include "common/base/workspace.hpp"
#include "devices/device.hpp"

namespace tandem::client {

/// User's changes of the scene's mapping.
struct WorkspaceSettings {
  double scale = 1;     ///< factor on the scene's position scale, > 0
  double turn_rad = 0;  ///< rotation of the device's base about the world's vertical, to match the user's seat and view
};

/// Combines the scene's mapping with the user's. Force and position have the same factor, so the user's scale does not
/// change the power: f_D · v_D = f_W · v_W times a constant of the scene.
WorkspaceMapping with_user(WorkspaceMapping scene, const WorkspaceSettings& user) noexcept;

/// Mapping in use, with rate control beyond the border.
///
/// Model   d: depth of the handle beyond a box of 0.8 × the device's workspace about D's origin, per axis, at most
///         d_max = 0.1 × its width. Within the box the hand moves the tool. Beyond it the base moves too, with
///         v = s_p · width/s · (d / d_max)²; a spring F = −F_wall · d / d_max is felt. F_wall is a quarter of the
///         device's limit, at most 2 N. Both begin at zero at the border.
///         Force: a force of the scene against the motion slows the base. It stops the base at half the device's limit,
///         so that the force cannot build up further.
///         Travel: the base moves at most L = 3 × the largest width (in the device's metres) per excursion beyond the
///         border: v is multiplied by min(1, (L − travel) / 0.2 L). A device that is laid down beyond the border thus
///         stops. The travel resets when the handle has been within 0.7 of the workspace.
///         Power: rate × the scene's force is power that the hand does not supply. It is at most F_limit / 2 · width/s
///         (0.2 W on a device of 0.1 m and 4 N), and F_limit / 2 · L in all. Energy limits count it as the hand's.
/// Source  Dominjon, Lécuyer, Burkhardt, Andrade-Barroso, Richir, "The 'Bubble' technique: interacting with large
///         virtual environments using haptic devices with limited workspace", World Haptics 2005: position control
///         within, rate control beyond, with a spring. Theirs uses a ball and a cubic law, without limits by force or
///         travel.
/// Thread  haptic: no allocation, no throw
class HandWorkspace {
 public:
  /// In      has_border  false, or a device without a known workspace: no border
  HandWorkspace(const devices::DeviceSpec& device, bool has_border) noexcept;

  /// Starts another scene with the base where its mapping places it.
  void enter(const WorkspaceMapping& scene) noexcept;
  /// Requests another mapping of the same scene; apply_change() applies it while the tool is held and no force is
  /// shown.
  void change(const WorkspaceMapping& scene) noexcept;
  bool is_changing() const noexcept { return is_changing_; }
  void apply_change() noexcept;

  /// Moves the base for one period.
  /// In      p_DH  position of the handle; scene_on_hand_D  force of the scene on the hand
  void advance(const Vec3& p_DH, const Vec3& scene_on_hand_D, double period_s) noexcept;
  /// Stops the base and removes the wall until the handle has been within the box again. A hand that starts beyond the
  /// border, or releases the clutch there, is thus not carried away.
  void rest() noexcept;

  const WorkspaceMapping& mapping() const noexcept { return mapping_; }
  /// Velocity of the base in the world [m/s].
  const Vec3& rate_W() const noexcept { return rate_W_; }
  /// Force of the border [N], in D.
  const Vec3& wall_on_hand_D() const noexcept { return wall_on_hand_D_; }

 private:
  void stop() noexcept;

  Vec3 half_ = Vec3::Zero();  ///< half the device's workspace [m]; zero: no border
  double force_limit_n_ = 0;
  WorkspaceMapping scene_;
  WorkspaceMapping mapping_;
  bool is_changing_ = false;
  bool was_within_ = false;
  double travelled_m_ = 0;  ///< travel of the base beyond the border, in D
  Vec3 rate_W_ = Vec3::Zero();
  Vec3 wall_on_hand_D_ = Vec3::Zero();
};

}  // namespace tandem::client

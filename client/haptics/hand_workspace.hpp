// How the hand's own small space lies in the scene's large one: the scene's mapping, what the user changes of it, and the
// border of the device's reach, beyond which the device's base moves through the scene.
#pragma once

#include "common/base/workspace.hpp"
#include "devices/device.hpp"

namespace tandem::client {

/// What a user changes of the scene's mapping.
struct WorkspaceSettings {
  double scale = 1;     ///< world metres per world metre that the scene has for a way of the hand, > 0
  double turn_rad = 0;  ///< of the device's base, about the world's vertical: as the user sits before his view
};

/// Force and way are scaled alike, so that a joule of the hand stays what it was: f_D · v_D = f_W · v_W times the same.
WorkspaceMapping with_user(WorkspaceMapping scene, const WorkspaceSettings& user) noexcept;

/// The mapping in force, and the border.
///
/// Model   d: how far the handle is beyond a box of 0.8 × the device's workspace about D's origin, for each axis, of at most
///         d_max = 0.1 × its width. Within the box the hand moves the tool. Beyond it the base moves too, by
///         v = s_p · width/s · (d / d_max)², and a spring F = −F_wall · d / d_max is felt, F_wall = a quarter of the device's
///         limit, at most 2 N: both begin at zero with the border. Against a force of the scene the base slows down, and
///         stands at half the device's limit, so that nothing is wound up. Its way, in the device's metres, is at most
///         L = 3 × the largest width each time that the handle is beyond the border: v is multiplied by
///         min(1, (L − way) / 0.2 L). So a device that is laid down there drives nothing away for ever. The way begins anew when
///         the handle has been within 0.7 of the workspace.
///         Rate × the scene's force is power that no hand gives: at most F_limit / 2 · width/s, a fifth of a watt
///         on a device of 0.1 m and 4 N, and F_limit / 2 · L in all. It counts as the hand's for whatever limits energy.
/// Source  Dominjon, Lécuyer, Burkhardt, Andrade-Barroso, Richir, "The 'Bubble' technique: interacting with large
///         virtual environments using haptic devices with limited workspace", World Haptics 2005: position within, rate
///         beyond, with a spring; theirs is a ball and a cubic, and its rate has no limit by force or way
/// Thread  haptic: no allocation, no throw
class HandWorkspace {
 public:
  /// In      has_border  false, or a device without limits of its own: none
  HandWorkspace(const devices::DeviceSpec& device, bool has_border) noexcept;

  /// Another scene: the base is where that puts it.
  void enter(const WorkspaceMapping& scene) noexcept;
  /// Another mapping of the same scene. It is taken by take_change(), with the tool held where it is and no force shown.
  void change(const WorkspaceMapping& scene) noexcept;
  bool is_changing() const noexcept { return is_changing_; }
  void take_change() noexcept;

  /// Moves the base for a period.
  /// In      p_DH  of the handle; scene_on_hand_D  what the hand feels of the scene
  void advance(const Vec3& p_DH, const Vec3& scene_on_hand_D, double period_s) noexcept;
  /// The base stands, and no wall is felt, until the handle comes back from within: a hand that begins at the border, or
  /// releases the clutch there, is not carried off.
  void rest() noexcept;

  const WorkspaceMapping& mapping() const noexcept { return mapping_; }
  /// Of the base [m/s], in the world.
  const Vec3& rate_W() const noexcept { return rate_W_; }
  /// Of the border [N], in D.
  const Vec3& wall_on_hand_D() const noexcept { return wall_on_hand_D_; }

 private:
  void stand() noexcept;

  Vec3 half_ = Vec3::Zero();  ///< of the device's workspace [m]; zero: no border
  double force_limit_n_ = 0;
  WorkspaceMapping scene_;
  WorkspaceMapping mapping_;
  bool is_changing_ = false;
  bool was_within_ = false;
  double travelled_m_ = 0;  ///< of the base beyond the border, in D
  Vec3 rate_W_ = Vec3::Zero();
  Vec3 wall_on_hand_D_ = Vec3::Zero();
};

}  // namespace tandem::client

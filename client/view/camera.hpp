// Where the scene is looked at from: on a ball about what is looked at, z up.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "common/base/spatial.hpp"

namespace tandem::client {

using Mat4f = Eigen::Matrix4f;

class Camera {
 public:
  static constexpr double kFieldOfView_rad = 0.55;  ///< from the lower to the upper edge

  /// Shows a ball whole, from where it was looked at last.
  void fit(const Vec3& centre_W, double radius_m);
  void look_at(const Vec3& point_W) { focus_W_ = point_W; }
  /// Goes around: by a share of the window's height.
  void orbit(double right, double down);
  /// Moves what is looked at with the mouse: by a share of the window's height.
  void pan(double right, double down);
  /// Nearer for more than 0 steps.
  void zoom(double steps);
  /// As a 3D mouse's cap holds the scene: it goes and turns that way as long as the cap is deflected.
  /// In      deflection  -1..1: to the right, away, up; turns about the same
  void steer(const Vec3& deflection, const Vec3& turn, double seconds);

  /// What is looked at is in the middle of what this share of the window's width leaves free at the right.
  void leave_free(double share) { left_free_ = share; }

  const Vec3& focus_W() const { return focus_W_; }
  double distance_m() const { return distance_m_; }
  /// Of who looks, about z; 0: from −y.
  double turn_rad() const { return turn_rad_; }
  Vec3 eye_W() const { return focus_W_ - distance_m_ * forward_W(); }
  Vec3 forward_W() const;
  Vec3 right_W() const;
  Vec3 up_W() const { return right_W().cross(forward_W()); }
  /// World metres that the window's height shows at the depth of a point.
  double height_at_m(const Vec3& point_W) const;

  /// From the eye through a place of the picture: shares of its width from the left, and of its height from above.
  /// Out     a point of it, and its direction
  std::pair<Vec3, Vec3> ray_at(double across, double down, double aspect) const;

  /// From the world to clip coordinates.
  /// In      aspect  width by height
  Mat4f projection_of_world(double aspect) const;

 private:
  Vec3 focus_W_ = Vec3::Zero();
  double distance_m_ = 0.5;
  double turn_rad_ = 0.45;   ///< about z; 0: from −y
  double above_rad_ = 0.42;  ///< over the horizon
  double left_free_ = 0;
};

/// The parallel projection of a sun that shines along `direction` on a ball.
Mat4f projection_of_sun(const Vec3& direction, const Vec3& centre_W, double radius_m);

}  // namespace tandem::client

// Camera on a sphere around its focus point. The z axis is up.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "common/base/spatial.hpp"

namespace tandem::client {

using Mat4f = Eigen::Matrix4f;

class Camera {
 public:
  static constexpr double kFieldOfView_rad = 0.55;  ///< vertical

  /// Fits a ball into the picture without changing the direction of view.
  void fit(const Vec3& centre_W, double radius_m);
  void focus_on(const Vec3& point_W) { focus_W_ = point_W; }
  /// Orbits around the focus. The arguments are fractions of the window's height.
  void orbit(double right, double down);
  /// Moves the focus with the mouse. The arguments are fractions of the window's height.
  void pan(double right, double down);
  /// Moves nearer for positive steps, farther away for negative ones.
  void zoom(double steps);
  /// Moves the view as if the cap of a 3D mouse held the scene. The speed is proportional to the cap's deflection.
  /// In      deflection  −1..1: to the right, away, up
  ///         turn        −1..1: about the same axes
  ///         seconds     time since the last call
  void steer(const Vec3& deflection, const Vec3& turn, double seconds);

  /// Centres the focus in the part of the window that is left of this fraction of its width.
  void leave_free(double share) { left_free_ = share; }

  const Vec3& focus_W() const { return focus_W_; }
  double distance_m() const { return distance_m_; }
  /// Azimuth of the eye about z; 0: the eye is at −y of the focus.
  double turn_rad() const { return turn_rad_; }
  Vec3 eye_W() const { return focus_W_ - distance_m_ * forward_W(); }
  Vec3 forward_W() const;
  Vec3 right_W() const;
  Vec3 up_W() const { return right_W().cross(forward_W()); }
  /// Height in world metres that the window covers at the depth of a point.
  double height_at_m(const Vec3& point_W) const;

  /// Returns the ray from the eye through a point of the picture. The point is given as fractions of the width from the
  /// left and of the height from the top.
  /// Out     origin and direction
  std::pair<Vec3, Vec3> ray_at(double across, double down, double aspect) const;

  /// Returns the projection from the world to clip coordinates.
  /// In      aspect  width divided by height
  Mat4f projection_of_world(double aspect) const;

 private:
  Vec3 focus_W_ = Vec3::Zero();
  double distance_m_ = 0.5;
  double turn_rad_ = 0.45;   ///< azimuth about z; 0: seen from −y
  double above_rad_ = 0.42;  ///< elevation above the horizon
  double left_free_ = 0;
};

/// Returns the parallel projection of a sun that shines along `direction` onto a ball.
Mat4f projection_of_sun(const Vec3& direction, const Vec3& centre_W, double radius_m);

}  // namespace tandem::client

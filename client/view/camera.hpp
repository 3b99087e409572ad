// Orbit camera: it looks at a focus point and moves on a sphere around it. The z axis of the world is up.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "common/base/spatial.hpp"

namespace tandem::client {

using Mat4f = Eigen::Matrix4f;

class Camera {
 public:
  static constexpr double kFieldOfView_rad = 0.55;  ///< vertical angle of view

  /// Moves the camera so that a ball fits into the picture. The direction of view does not change.
  void fit(const Vec3& centre_W, double radius_m);
  void focus_on(const Vec3& point_W) { focus_W_ = point_W; }
  /// Orbits around the focus for a mouse motion, which is given in fractions of the window's height.
  void orbit(double right, double down);
  /// Shifts the focus for a mouse motion, which is given in fractions of the window's height.
  void pan(double right, double down);
  /// Moves the camera towards the focus for positive steps, and away from it for negative steps.
  void zoom(double steps);
  /// Moves the camera such that the scene seems to follow the cap of a 3D mouse. The speed is proportional to the cap's
  /// deflection.
  /// In      deflection  translation of the cap to the right, away from the user and up, each −1 to 1
  ///         turn        rotation of the cap about these three axes, each −1 to 1
  ///         seconds     time since the last call
  void steer(const Vec3& deflection, const Vec3& turn, double seconds);

  /// Centres the focus in the left part of the window, because panels cover the right part.
  /// In      share  width of the left part, as a fraction of the window's width
  void leave_free(double share) { left_free_ = share; }

  const Vec3& focus_W() const { return focus_W_; }
  double distance_m() const { return distance_m_; }
  /// Azimuth of the eye about the z axis. At 0 the eye is on the −y side of the focus.
  double turn_rad() const { return turn_rad_; }
  Vec3 eye_W() const { return focus_W_ - distance_m_ * forward_W(); }
  Vec3 forward_W() const;
  Vec3 right_W() const;
  Vec3 up_W() const { return right_W().cross(forward_W()); }
  /// Height in world metres that the window covers at the depth of a point.
  double height_at_m(const Vec3& point_W) const;

  /// Returns the ray from the eye through a point of the picture.
  /// In      across  distance from the left edge, as a fraction of the width
  ///         down    distance from the upper edge, as a fraction of the height
  /// Out     origin and direction
  std::pair<Vec3, Vec3> ray_at(double across, double down, double aspect) const;

  /// Returns the projection from the world to clip coordinates.
  /// In      aspect  width divided by height
  Mat4f projection_of_world(double aspect) const;

 private:
  Vec3 focus_W_ = Vec3::Zero();
  double distance_m_ = 0.5;
  double turn_rad_ = 0.45;   ///< azimuth, see turn_rad()
  double above_rad_ = 0.42;  ///< elevation of the eye above the horizontal plane
  double left_free_ = 0;
};

/// Returns the orthographic projection for the shadow map of a sun that shines along `direction` onto a ball.
Mat4f projection_of_sun(const Vec3& direction, const Vec3& centre_W, double radius_m);

}  // namespace tandem::client

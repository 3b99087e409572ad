#include "client/view/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::client {
namespace {

constexpr double kSteepest_rad = 1.55;
constexpr double kNearest_m = 0.005;
constexpr double kFarthest_m = 1000;
/// Orbit angle for a motion of the mouse over the whole height of the window.
constexpr double kTurn_rad = std::numbers::pi;
constexpr double kZoomStep = 1.15;
/// Speeds at full deflection of a 3D mouse's cap: pan and orbit, in fractions of the window's height per second.
/// kSteerZoom is the number of zoom steps for a distance of one window height.
constexpr double kSteerPan_per_s = 0.7;
constexpr double kSteerOrbit_per_s = 0.35;
constexpr double kSteerZoom = 9;

/// Returns the view matrix of a camera at `eye`. Its first three rows are the directions right, up and back.
Mat4f view_of(const Vec3& right, const Vec3& up, const Vec3& back, const Vec3& eye) {
  Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
  view.block<1, 3>(0, 0) = right.transpose();
  view.block<1, 3>(1, 0) = up.transpose();
  view.block<1, 3>(2, 0) = back.transpose();
  view.block<3, 1>(0, 3) = -view.block<3, 3>(0, 0) * eye;
  return view.cast<float>();
}

}  // namespace

void Camera::fit(const Vec3& centre_W, double radius_m) {
  focus_W_ = centre_W;
  distance_m_ = std::clamp(radius_m / std::sin(kFieldOfView_rad / 2), kNearest_m, kFarthest_m);
}

void Camera::orbit(double right, double down) {
  turn_rad_ = std::remainder(turn_rad_ - kTurn_rad * right, 2 * std::numbers::pi);
  above_rad_ = std::clamp(above_rad_ + kTurn_rad * down, -kSteepest_rad, kSteepest_rad);
}

void Camera::pan(double right, double down) {
  focus_W_ += height_at_m(focus_W_) * (down * up_W() - right * right_W());
}

void Camera::zoom(double steps) {
  distance_m_ = std::clamp(distance_m_ * std::pow(kZoomStep, -steps), kNearest_m, kFarthest_m);
}

void Camera::steer(const Vec3& deflection, const Vec3& turn, double seconds) {
  const double period_s = std::clamp(seconds, 0.0, 0.1);
  const Vec3 way = kSteerPan_per_s * period_s * deflection.cwiseMax(-1.0).cwiseMin(1.0);
  const Vec3 angle = kSteerOrbit_per_s * period_s * turn.cwiseMax(-1.0).cwiseMin(1.0);
  pan(way.x(), -way.z());
  zoom(-kSteerZoom * way.y());
  orbit(angle.z(), angle.x());
}

Vec3 Camera::forward_W() const {
  const double level = std::cos(above_rad_);
  return {-std::sin(turn_rad_) * level, std::cos(turn_rad_) * level, -std::sin(above_rad_)};
}

Vec3 Camera::right_W() const {
  return {std::cos(turn_rad_), std::sin(turn_rad_), 0};
}

double Camera::height_at_m(const Vec3& point_W) const {
  const double depth_m = std::max(kNearest_m, (point_W - eye_W()).dot(forward_W()));
  return 2 * depth_m * std::tan(kFieldOfView_rad / 2);
}

std::pair<Vec3, Vec3> Camera::ray_at(double across, double down, double aspect) const {
  const double size = std::tan(kFieldOfView_rad / 2);
  const double right = (2 * across - 1 + left_free_) * aspect * size, up = (1 - 2 * down) * size;
  return {eye_W(), (forward_W() + right * right_W() + up * up_W()).normalized()};
}

Mat4f Camera::projection_of_world(double aspect) const {
  const double near_m = 0.02 * distance_m_, far_m = 60 * distance_m_;
  const double scale = 1 / std::tan(kFieldOfView_rad / 2);
  Eigen::Matrix4d projection = Eigen::Matrix4d::Zero();
  projection(0, 0) = scale / aspect;
  projection(0, 2) = left_free_;
  projection(1, 1) = scale;
  projection(2, 2) = -(far_m + near_m) / (far_m - near_m);
  projection(2, 3) = -2 * far_m * near_m / (far_m - near_m);
  projection(3, 2) = -1;
  return projection.cast<float>() * view_of(right_W(), up_W(), -forward_W(), eye_W());
}

Mat4f projection_of_sun(const Vec3& direction, const Vec3& centre_W, double radius_m) {
  const Vec3 back = -direction.normalized();
  const Vec3 right = Vec3::UnitZ().cross(back).normalized();
  const Vec3 up = back.cross(right);
  Mat4f scale = Mat4f::Identity();
  const auto inverse = static_cast<float>(1 / radius_m);
  scale(0, 0) = scale(1, 1) = inverse;
  scale(2, 2) = -inverse / 2;
  return scale * view_of(right, up, back, centre_W);
}

}  // namespace tandem::client

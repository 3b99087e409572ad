#include "client/haptics/hand_workspace.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

constexpr double kInnerShare = 0.8;
// Force of the wall at the border: upper limit [N], and fraction of the device's force limit
constexpr double kMaxWall_n = 2, kWallShare = 0.25;
// Force of the scene against the base's motion at which the base stops, as a fraction of the device's force limit
constexpr double kStandsAtShare = 0.5;
constexpr double kWidths_per_s = 1;
// Maximum travel of the base in one excursion, in largest widths of the workspace. The base slows down over the last
// kSlowShare of the travel.
constexpr double kMaxTravel_widths = 3, kSlowShare = 0.2;
// Fraction of the workspace in which the travel of the base is reset. It is smaller than kInnerShare (hysteresis).
constexpr double kFreshShare = 0.7;

bool is_same(const WorkspaceMapping& a, const WorkspaceMapping& b) {
  return tandem::is_same(a.X_WD, b.X_WD) && a.position_scale == b.position_scale && a.force_scale == b.force_scale;
}

}  // namespace

WorkspaceMapping with_user(WorkspaceMapping scene, const WorkspaceSettings& user) noexcept {
  scene.X_WD.q = (quaternion_of(user.turn_rad * Vec3::UnitZ()) * scene.X_WD.q).normalized();
  scene.position_scale *= user.scale;
  scene.force_scale *= user.scale;
  return scene;
}

HandWorkspace::HandWorkspace(const devices::DeviceSpec& device, bool has_border) noexcept
    : force_limit_n_(device.has_force() ? device.force_limit_n : 0) {
  if (has_border && device.workspace_m.minCoeff() > 0) half_ = device.workspace_m / 2;
}

void HandWorkspace::enter(const WorkspaceMapping& scene) noexcept {
  scene_ = mapping_ = scene;
  is_changing_ = false;
  travelled_m_ = 0;
  rest();
}

void HandWorkspace::change(const WorkspaceMapping& scene) noexcept {
  is_changing_ = is_changing_ || !is_same(scene, scene_);
  scene_ = scene;
}

void HandWorkspace::apply_change() noexcept {
  if (is_changing_) enter(scene_);
}

void HandWorkspace::rest() noexcept {
  was_within_ = false;
  stop();
}

void HandWorkspace::stop() noexcept {
  rate_W_.setZero();
  wall_on_hand_D_.setZero();
}

void HandWorkspace::advance(const Vec3& p_DH, const Vec3& scene_on_hand_D, double period_s) noexcept {
  stop();
  const auto is_within = [&](double share) { return (p_DH.cwiseAbs().array() <= share * half_.array()).all(); };
  was_within_ = was_within_ || is_within(kInnerShare);
  if (is_within(kFreshShare)) travelled_m_ = 0;
  if (half_.isZero(0) || !was_within_) return;
  Vec3 rate_D = Vec3::Zero();
  const double wall_n = std::min(kMaxWall_n, kWallShare * force_limit_n_);
  for (int i = 0; i < 3; ++i) {
    const double most = (1 - kInnerShare) * half_[i];
    const double depth = std::min(std::max(0.0, std::abs(p_DH[i]) - kInnerShare * half_[i]) / most, 1.0);
    const double outwards = p_DH[i] < 0 ? -1 : 1;
    rate_D[i] = outwards * depth * depth * kWidths_per_s * 2 * half_[i];
    wall_on_hand_D_[i] = -outwards * depth * wall_n;
  }
  if (rate_D.isZero(0)) return;
  const double against_n = -scene_on_hand_D.dot(rate_D.normalized());
  const double stands_at_n = kStandsAtShare * force_limit_n_;
  if (stands_at_n > 0) rate_D *= std::clamp(1 - against_n / stands_at_n, 0.0, 1.0);
  const double most_m = kMaxTravel_widths * 2 * half_.maxCoeff();
  rate_D *= std::clamp((most_m - travelled_m_) / (kSlowShare * most_m), 0.0, 1.0);
  travelled_m_ += rate_D.norm() * period_s;
  rate_W_ = mapping_.X_WD.q * (mapping_.position_scale * rate_D);
  mapping_.X_WD.p += rate_W_ * period_s;
}

}  // namespace tandem::client

#include "client/model/partner.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::client {
namespace {

// Ours, found on squeezing, docking, a peg, bars and plates that two and three hold, at 0–300 ms with jitter and loss.
constexpr double kWishCorner_hz = 0.5;
constexpr double kWishOfMolecule = 0.7;
constexpr double kWishAcross = 0.6;  ///< of what both press
constexpr double kWishAlong = 0.3;   ///< likewise, along the pressing direction
constexpr double kWishOfGrip = 0.5;  ///< of what both hold
/// Of the way of what both press the hand goes along by kAlong · H/(H + kAlongFrom_s).
constexpr double kGoesAlong = 0.7;
constexpr double kGoesAlongFrom_s = 0.02;
constexpr double kGripGoesAlong = 0.5;  ///< of that, of what both hold
/// In which these come and go.
constexpr double kChange_s = 0.05;

void approach(double& value, double goal, double period_s) noexcept {
  value += std::clamp(goal - value, -period_s / kChange_s, period_s / kChange_s);
}

RigidState as_position(const Vec3& value) noexcept {
  return {{value, Quat::Identity()}, {}};
}

}  // namespace

void GivingHand::step(const Wrench& on_hand_W, double h) noexcept {
  V_.v = (kMass_kg * V_.v + h * (on_hand_W.f - kStiffness_n_per_m * p_)) /
         (kMass_kg + h * kDamping_n_s_per_m + h * h * kStiffness_n_per_m);
  p_ += h * V_.v;
  V_.w = (kInertia_kg_m2 * V_.w + h * (on_hand_W.t - kStiffness_n_m_per_rad * theta_)) /
         (kInertia_kg_m2 + h * kDamping_n_m_s_per_rad + h * h * kStiffness_n_m_per_rad);
  theta_ += h * V_.w;
}

void Partner::take(const proto::OtherUserState& told, const proto::ServerUpdate& update) noexcept {
  if (holds_ != told.holds) X_BT_.reset();
  const auto held = std::find_if(update.bodies.begin(), update.bodies.end(),
                                 [&told](const proto::BodyState& body) { return body.id == told.holds; });
  if (told.holds.is_valid() && held != update.bodies.end()) X_BT_ = held->state.X.inverse() * told.tool.X;
  holds_ = told.holds;
  tool_ = told.tool_index;
  told_tool_ = told.tool;
  told_at_ = update.stepped;
  handle_age_ = told.handle_age;
  if (!told.has_handle) return handle_.reset();
  const Duration stepped = update.stepped.time_since_epoch();
  handle_.add(stepped, told.handle, update.step.value);
  force_.add(stepped, as_position(told.on_hand_W.f), update.step.value);
  torque_.add(stepped, as_position(told.on_hand_W.t), update.step.value);
}

void Partner::follow_wish(const RigidState& told, double period_s) noexcept {
  const double part = 1 - std::exp(-2 * std::numbers::pi * kWishCorner_hz * period_s);
  const Vec3 wished = told.X.p - shown_.p();
  if (!slow_p_) slow_p_ = wished;
  *slow_p_ += part * (wished - *slow_p_);
  // By places: a gap in what is told then is a rest, and no change of velocity.
  wish_.v = (wished - *slow_p_) * (part / period_s);
  wish_.w += part * (told.V.w - shown_.V().w - wish_.w);
}

void Partner::follow_grip(const PartnerSurroundings& around, double period_s) noexcept {
  const bool has_common = around.common.has_value();
  const bool is_gripped = has_common && around.common->is_held_by_partner;
  approach(common_share_, has_common ? 1 : 0, period_s);
  approach(afar_share_, around.holds_molecule ? 1 : 0, period_s);
  const double part = std::min(1.0, period_s / kChange_s);
  if (is_gripped) pressing_W_ *= 1 - part;
  if (!has_common || is_gripped || around.common->pressing_W.norm() < 0.5) return;
  // An axis has no sign.
  const Vec3& now_W = around.common->pressing_W;
  const Vec3 like_W = pressing_W_.dot(now_W) < 0 ? Vec3(-now_W) : now_W;
  pressing_W_ += part * (like_W.normalized() - pressing_W_);
}

Vec3 Partner::across(const Vec3& way) const noexcept {
  const double share = pressing_W_.norm();
  return share > 1e-6 ? Vec3(way - pressing_W_.dot(way) / share * pressing_W_) : way;
}

RigidState Partner::foresee(Duration played, double since_s, const PartnerSurroundings& around,
                            double period_s) noexcept {
  const RigidState told = handle_.at(played);
  const double late_s = since_s + to_seconds(handle_age_);
  modelled_.step(around.on_hand_W, period_s);
  shown_.step({force_.at(played).X.p, torque_.at(played).X.p}, period_s);
  follow_wish(told, period_s);
  follow_grip(around, period_s);

  const bool is_gripped = around.common && around.common->is_held_by_partner;
  const double of_grip = is_gripped ? kWishOfGrip * common_share_ : 0;
  const double of_pressed = is_gripped ? 0 : common_share_;
  const Vec3 across_v = across(wish_.v);
  Twist wish;
  wish.v = (kWishOfMolecule * afar_share_ + of_grip) * wish_.v + kWishAcross * of_pressed * across_v +
           kWishAlong * common_share_ * (wish_.v - across_v);
  wish.w = (kWishOfMolecule * afar_share_ + of_grip) * wish_.w;

  RigidState now;
  now.X.p = told.X.p + modelled_.p() - shown_.p() + late_s * wish.v;
  now.X.q = (quaternion_of(modelled_.theta() - shown_.theta() + late_s * wish.w) * told.X.q).normalized();
  now.V = {modelled_.V().v + wish.v, modelled_.V().w + wish.w};
  if (!around.common) return now;

  const CommonBody& body = *around.common;
  const double share =
      (is_gripped ? kGripGoesAlong : 1) * common_share_ * kGoesAlong * late_s / (late_s + kGoesAlongFrom_s);
  const Pose along = body.here.X * (body.X_there.inverse() * told.X);
  now.X.p += share * across(along.p - now.X.p);
  now.X.q = (quaternion_of(share * rotation_vector(along.q * now.X.q.conjugate())) * now.X.q).normalized();
  const Vec3 v_along = body.here.V.v + body.here.V.w.cross(now.X.p - body.here.X.p);
  now.V.v += share * across(v_along - now.V.v);
  return now;
}

}  // namespace tandem::client

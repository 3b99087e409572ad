#include "client/model/partner.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

/// Index of the relaxed hand in the grid of hypothetical hands of HandEstimate (three masses times three stiffnesses).
/// It is the centre of the grid.
constexpr std::size_t kRelaxed = 4;
double mass_of(std::size_t j) noexcept {
  const std::size_t column = j % 3;
  return GivingHand::kMass_kg * std::pow(4.5, static_cast<double>(column) - 1);
}
double stiffness_of(std::size_t j) noexcept {
  const std::size_t row = j / 3;
  return GivingHand::kStiffness_n_per_m * std::pow(2.7, static_cast<double>(row) - 1);
}
using Logarithms = std::array<double, HandEstimate::kHands>;
Logarithms logarithms(double (*of)(std::size_t j) noexcept) noexcept {
  Logarithms result{};
  for (std::size_t j = 0; j < result.size(); ++j) result[j] = std::log(of(j));
  return result;
}
const Logarithms kLogMasses = logarithms(mass_of), kLogStiffnesses = logarithms(stiffness_of);
constexpr double kOtherPrior = 0.2;
/// Added to the score of each hypothetical hand [m² s]. Differences between scores below this value are noise.
constexpr double kMinSquare = 1e-7;
constexpr double kSettle_s = 0.2;
/// HandEstimate scores each hand by a fixed forecast. The forecast velocity is a weighted sum of two low-pass filtered
/// velocities. The weights are those of the fast and of the slow filter of TrajectoryForecast.
constexpr double kFastShare = 1.1, kSlowShare = -0.4;

double fourth_power(double x) {
  return x * x * x * x;
}

/// Time for a change of common_share_ from 0 to 1 or back. The rise of coupled_share_ and lately_common_ takes the same
/// time.
constexpr double kChange_s = 0.05;
/// Time in which coupled_share_ and lately_common_ fall from 1 to 0. They fall slowly, because a body that two users
/// press from both sides may lose contact briefly.
constexpr double kUncouple_s = 2;

void approach(double& value, double goal, double period_s) noexcept {
  value += std::clamp(goal - value, -period_s / kChange_s, period_s / kChange_s);
}

void keep_slowly(double& share, bool is_so, double period_s) noexcept {
  share = std::clamp(share + (is_so ? period_s / kChange_s : -period_s / kUncouple_s), 0.0, 1.0);
}

RigidState as_position(const Vec3& value) noexcept {
  return {{value, Quat::Identity()}, {}};
}

}  // namespace

void GivingHand::step(const Wrench& on_hand_W, double h) noexcept {
  V_.v = (mass_kg_ * V_.v + h * (on_hand_W.f - stiffness_n_per_m_ * p_)) /
         (mass_kg_ + h * kDamping_n_s_per_m + h * h * stiffness_n_per_m_);
  p_ += h * V_.v;
  V_.w = (kInertia_kg_m2 * V_.w + h * (on_hand_W.t - kStiffness_n_m_per_rad * theta_)) /
         (kInertia_kg_m2 + h * kDamping_n_m_s_per_rad + h * h * kStiffness_n_m_per_rad);
  theta_ += h * V_.w;
}

void GivingHand::set(double mass_kg, double stiffness_n_per_m) noexcept {
  mass_kg_ = mass_kg;
  stiffness_n_per_m_ = stiffness_n_per_m;
}

HandEstimate::HandEstimate()
    : log_mass_(std::log(GivingHand::kMass_kg)), log_stiffness_(std::log(GivingHand::kStiffness_n_per_m)) {
  for (std::size_t j = 0; j < kHands; ++j) hands_[j].set(mass_of(j), stiffness_of(j));
}

/// Adds a squared error to the score of hand j. The error is the intended position that follows from hand j now, minus
/// the forecast of this position made kHorizon_s earlier.
void HandEstimate::score(std::size_t j, const Vec3& intent, double fast, double slow, double period_s) noexcept {
  if (count_ == 0) fast_[j] = slow_[j] = intent;
  fast_[j] += fast * (intent - fast_[j]);
  slow_[j] += slow * (intent - slow_[j]);
  const Vec3 moved = kFastShare * fast * (intent - fast_[j]) + kSlowShare * slow * (intent - slow_[j]);
  Vec3& forecast = forecasts_[next_][j];
  if (count_ == kKept) squares_[j] += (intent - forecast).squaredNorm() * period_s;
  forecast = intent + kHorizon_s / period_s * moved;
}

void HandEstimate::observe(const Vec3& handle_W, const Vec3& shown_W, double period_s) noexcept {
  const double fast = haptics::low_pass_part(haptics::TrajectoryForecast::kFast_hz, period_s);
  const double slow = haptics::low_pass_part(haptics::TrajectoryForecast::kSlow_hz, period_s);
  const double kept = std::exp(-period_s / kMemory_s);
  double weights = 0, log_mass = 0, log_stiffness = 0;
  for (std::size_t j = 0; j < kHands; ++j) {
    hands_[j].step({shown_W, Vec3::Zero()}, period_s);
    score(j, handle_W - hands_[j].p(), fast, slow, period_s);
    squares_[j] *= kept;
    const double weight = (j == kRelaxed ? 1.0 : kOtherPrior) / fourth_power(squares_[j] + kMinSquare);
    weights += weight;
    log_mass += weight * kLogMasses[j];
    log_stiffness += weight * kLogStiffnesses[j];
  }
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
  if (!(weights > 0) || !std::isfinite(weights)) return;
  const double part = std::min(1.0, period_s / kSettle_s);
  log_mass_ += part * (log_mass / weights - log_mass_);
  log_stiffness_ += part * (log_stiffness / weights - log_stiffness_);
}

double HandEstimate::mass_kg() const {
  return std::exp(log_mass_);
}

double HandEstimate::stiffness_n_per_m() const {
  return std::exp(log_stiffness_);
}

void Partner::receive(const proto::OtherUserState& received, const proto::ServerUpdate& update) noexcept {
  if (holds_ != received.holds) X_BT_.reset();
  const auto held = std::find_if(update.bodies.begin(), update.bodies.end(),
                                 [&received](const proto::BodyState& body) { return body.id == received.holds; });
  if (received.holds.is_valid() && held != update.bodies.end()) X_BT_ = held->state.X.inverse() * received.tool.X;
  holds_ = received.holds;
  tool_ = received.tool_index;
  received_tool_ = received.tool;
  received_at_ = update.stepped;
  handle_age_ = received.handle_age;
  if (!received.has_handle) {
    handle_.reset();
    force_.reset();
    torque_.reset();
    intent_.reset();
    turn_intent_.reset();
    return;
  }
  const Duration stepped = update.stepped.time_since_epoch();
  handle_.add(stepped, received.handle);
  force_.add(stepped, as_position(received.on_hand_W.f));
  torque_.add(stepped, as_position(received.on_hand_W.t));
}

void Partner::follow_grip(const PartnerSurroundings& around, double period_s) noexcept {
  const bool has_common = around.has_common_body;
  const bool is_gripped = has_common && around.is_held;
  approach(common_share_, has_common ? 1 : 0, period_s);
  keep_slowly(coupled_share_, around.is_coupled, period_s);
  keep_slowly(lately_common_, has_common, period_s);
  const double part = std::min(1.0, period_s / kChange_s);
  if (is_gripped) pressing_W_ *= 1 - part;
  if (!has_common || is_gripped || around.pressing_W.norm() < 0.5) return;
  // A contact normal and its opposite are equivalent here. The new normal gets the sign that agrees with the smoothed
  // normal.
  const Vec3& now_W = around.pressing_W;
  const Vec3 like_W = pressing_W_.dot(now_W) < 0 ? Vec3(-now_W) : now_W;
  pressing_W_ += part * (like_W.normalized() - pressing_W_);
}

Vec3 Partner::across(const Vec3& way) const noexcept {
  const double share = pressing_W_.norm();
  return share > 1e-6 ? Vec3(way - pressing_W_.dot(way) / share * pressing_W_) : way;
}

RigidState Partner::predict(Duration played, double since_s, const PartnerSurroundings& around,
                            double period_s) noexcept {
  const RigidState sampled = handle_.at(played);
  const double late_s = since_s + to_seconds(handle_age_);
  const Wrench shown_W{force_.at(played).X.p, torque_.at(played).X.p};
  hand_.observe(sampled.X.p, shown_W.f, period_s);
  modelled_.set(hand_.mass_kg(), hand_.stiffness_n_per_m());
  shown_.set(hand_.mass_kg(), hand_.stiffness_n_per_m());
  modelled_.step(around.on_hand_W, period_s);
  shown_.step(shown_W, period_s);

  follow_grip(around, period_s);

  haptics::TrajectoryForecast::Way along, turn_along;
  if (around.has_common_body) {
    along = {common_share_ * across(around.body.X.p - around.X_WB_then.p), common_share_ * across(around.body.V.v)};
    turn_along = {common_share_ * rotation_vector(around.body.X.q * around.X_WB_then.q.conjugate()),
                  common_share_ * around.body.V.w};
  }
  turned_ += rotation_vector(sampled.X.q * q_before_.conjugate());
  q_before_ = sampled.X.q;
  auto intent = intent_.step(sampled.X.p - shown_.p(), late_s, along, coupled_share_, period_s);
  auto turn_intent = turn_intent_.step(turned_ - shown_.theta(), late_s, turn_along, coupled_share_, period_s);
  if (!around.is_predicted) intent = turn_intent = {};

  RigidState now;
  now.X.p = sampled.X.p + modelled_.p() - shown_.p() + intent.way;
  now.X.q = (quaternion_of(modelled_.theta() - shown_.theta() + turn_intent.way) * sampled.X.q).normalized();
  now.V = {modelled_.V().v + intent.velocity, modelled_.V().w + turn_intent.velocity};
  return now;
}

}  // namespace tandem::client

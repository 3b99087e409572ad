#include "server/physics/soft_step.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::server {
namespace {

/// Margin of the search for candidates (pairs of sample and object that may touch in the step), added to the motions of
/// both. It covers corrections of neighbouring nodes, which are assumed to move a sample by at most this distance.
constexpr double kMargin_m = 8e-3;
/// Depth below which a sample counts as lying on the surface. A sample that was just moved onto the surface may have
/// such a depth by rounding, and needs no further correction.
constexpr double kTouch_m = 1e-7;

/// Returns the pose at the fraction `share` (0..1) of the motion from `a` to `b`.
Pose between(const Pose& a, const Pose& b, double share) {
  return {a.p + share * (b.p - a.p), a.q.slerp(share, b.q)};
}

/// Returns an upper bound of the displacement of any point of an object.
double way_m(const SoftThing& thing) {
  const double turn = rotation_vector(thing.X_WT.q * thing.X_WT_before.q.conjugate()).norm();
  return (thing.X_WT.p - thing.X_WT_before.p).norm() + turn * thing.model->radius_m;
}

/// Returns ∂n/∂p, the derivative of the distance field's unit gradient n with respect to the point, by finite
/// differences. Returns zero at edges, where n is discontinuous.
Eigen::Matrix3d bend(const contact::DistanceField& field, const Vec3& p_S) {
  constexpr double kStep_m = 2e-4;
  constexpr double kSharp_per_m = 1e3;
  Eigen::Matrix3d bend;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep_m * Vec3::Unit(axis);
    const Vec3 ahead = field.sample(p_S + step).gradient.normalized();
    const Vec3 behind = field.sample(p_S - step).gradient.normalized();
    bend.col(axis) = (ahead - behind) / (2 * kStep_m);
  }
  if (!(bend.norm() < kSharp_per_m)) return Eigen::Matrix3d::Zero();
  return (bend + bend.transpose()) / 2;
}

}  // namespace

/// A sample and a part of an object that may touch in this step.
struct SoftStep::Candidate {
  int sample = 0;
  int thing = 0;
  int part = 0;
  double mobility = 0;  ///< inverse effective mass of the sample [1/kg]
  Vec3 p_T_start = Vec3::Zero();
  double normal_sum = 0;               ///< Σ λ of the sample so far in this step
  Vec3 friction_sum_W = Vec3::Zero();  ///< sum of the friction corrections
  double clearance_m = 0;              ///< lower bound of the distance between the part and p_S_seen
  Vec3 p_S_seen = Vec3::Zero();        ///< sample position, in the part's frame, of the last distance query
  bool is_bend_known = false;
  Eigen::Matrix3d bend_S = Eigen::Matrix3d::Zero();
};

/// Pose of an object during a sweep.
struct SoftStep::Place {
  Pose X_WT;
  double share = 0;
};

SoftStep::SoftStep(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps)
    : body_(model, gravity_m_per_s2), sweeps_(sweeps) {}

SoftStep::~SoftStep() = default;

std::size_t SoftStep::candidate_count() const {
  return candidates_.size();
}

bool SoftStep::step(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things,
                    std::span<SoftReaction> reactions) {
  step_s_ = step_s;
  pushes_.clear();
  places_.resize(things.size());
  body_.predict(step_s);
  find_candidates(things);
  for (int sweep = 0; sweep < sweeps_; ++sweep) {
    remember_nodes(sweep);
    body_.solve_links();
    body_.solve_volume();
    place_things(things, sweep);
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      solve_contact(things[static_cast<std::size_t>(candidates_[i].thing)], static_cast<int>(i), sweep, reactions);
    }
  }
  return body_.finish(step_s, speed_limit_m_per_s);
}

void SoftStep::remember_nodes(int sweep) {
  const std::size_t count = static_cast<std::size_t>(body_.node_count());
  trail_.resize(count * static_cast<std::size_t>(sweeps_));
  Vec3* const nodes = &trail_[count * static_cast<std::size_t>(sweep)];
  for (std::size_t i = 0; i < count; ++i) nodes[i] = body_.position(static_cast<int>(i));
}

std::span<const Vec3> SoftStep::nodes_at(int sweep) const {
  const std::size_t count = static_cast<std::size_t>(body_.node_count());
  return std::span(trail_).subspan(count * static_cast<std::size_t>(sweep), count);
}

void SoftStep::update_bounds() {
  low_W_ = high_W_ = body_.position(0);
  for (int i = 0; i < body_.node_count(); ++i) {
    low_W_ = low_W_.cwiseMin(body_.position(i)).cwiseMin(body_.position_before(i));
    high_W_ = high_W_.cwiseMax(body_.position(i)).cwiseMax(body_.position_before(i));
  }
}

bool SoftStep::is_near(const SoftThing& thing, double margin_m) const {
  const Vec3 nearest = thing.X_WT.p.cwiseMax(low_W_).cwiseMin(high_W_);
  if ((nearest - thing.X_WT.p).norm() > thing.model->radius_m + margin_m) return false;
  // A flat object, such as a table, has a bounding sphere that is much too large. The distance of its surface from the
  // bounding sphere of the body is therefore checked as well.
  const Vec3 centre = (low_W_ + high_W_) / 2;
  const double reach = (high_W_ - low_W_).norm() / 2 + margin_m;
  return std::any_of(thing.model->parts.begin(), thing.model->parts.end(), [&](const physics::TouchModel::Part& part) {
    return part.shape->field->distance_m((thing.X_WT * part.X_BS).inverse() * centre) < reach;
  });
}

void SoftStep::find_candidates(std::span<const SoftThing> things) {
  candidates_.clear();
  update_bounds();
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].is_present) find_candidates(things[i], static_cast<int>(i));
  }
}

void SoftStep::find_candidates(const SoftThing& thing, int index) {
  const double margin = kMargin_m + way_m(thing);
  if (!is_near(thing, margin)) return;
  const Pose X_TW_before = thing.X_WT_before.inverse();
  const std::vector<SoftSample>& samples = body_.model().samples;
  for (std::size_t part = 0; part < thing.model->parts.size(); ++part) {
    const physics::TouchModel::Part& shape = thing.model->parts[part];
    const Pose X_SW = (thing.X_WT * shape.X_BS).inverse();
    const double radius = shape.shape->radius_m();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Vec3 p_W = body_.position(samples[i]), before_W = body_.position_before(samples[i]);
      const double reach = margin + (p_W - before_W).norm();
      const Vec3 p_S = X_SW * p_W;
      if (p_S.norm() > radius + reach || shape.shape->field->distance_m(p_S) > reach) continue;
      const double mobility = body_.inverse_mass(samples[i]);
      if (mobility <= 0) continue;
      Candidate candidate;
      candidate.sample = static_cast<int>(i);
      candidate.thing = index;
      candidate.part = static_cast<int>(part);
      candidate.mobility = mobility;
      candidate.p_T_start = X_TW_before * before_W;
      candidates_.push_back(candidate);
    }
  }
}

void SoftStep::place_things(std::span<const SoftThing> things, int sweep) {
  const double share = std::min(1.0, 2.0 * (sweep + 1) / sweeps_);
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].is_present) places_[i] = {between(things[i].X_WT_before, things[i].X_WT, share), share};
  }
}

void SoftStep::apply(const Candidate& candidate, const Vec3& push_W, const Vec3& p_W,
                     std::span<SoftReaction> reactions) {
  body_.push(body_.model().samples[static_cast<std::size_t>(candidate.sample)], push_W);
  SoftReaction& reaction = reactions[static_cast<std::size_t>(candidate.thing)];
  const Vec3 impulse_W = -push_W / step_s_;
  const Vec3 lever_W = p_W - places_[static_cast<std::size_t>(candidate.thing)].X_WT.p;
  reaction.impulse_W += {impulse_W, lever_W.cross(impulse_W)};
  reaction.impulse_sum += impulse_W.norm();
  reaction.lever_sum_m += lever_W.norm() * impulse_W.norm();
}

void SoftStep::solve_contact(const SoftThing& thing, int index, int sweep, std::span<SoftReaction> reactions) {
  Candidate& candidate = candidates_[static_cast<std::size_t>(index)];
  const contact::DistanceField& field = *thing.model->parts[static_cast<std::size_t>(candidate.part)].shape->field;
  const Place& place = places_[static_cast<std::size_t>(candidate.thing)];
  const Pose X_WS = place.X_WT * thing.model->parts[static_cast<std::size_t>(candidate.part)].X_BS;
  const Vec3 p_W = body_.position(body_.model().samples[static_cast<std::size_t>(candidate.sample)]);
  const Vec3 p_S = X_WS.q.conjugate() * (p_W - X_WS.p);
  // When a point moves, its distance changes by at most the displacement (Lipschitz bound). Most queries can therefore
  // be skipped.
  if (candidate.clearance_m > 0 && (p_S - candidate.p_S_seen).norm() < candidate.clearance_m) return;
  const contact::DistanceSample found = field.sample(p_S);
  candidate.clearance_m = found.distance_m - field.error_m();
  candidate.p_S_seen = p_S;
  const bool is_touching = found.distance_m < -kTouch_m;
  if (!is_touching && (candidate.normal_sum <= 0 || found.distance_m > kTouch_m)) return;

  SoftPush push;
  push.sweep = sweep;
  push.candidate = index;
  push.sample = candidate.sample;
  push.thing = candidate.thing;
  push.mass_kg = 1 / candidate.mobility;
  push.way_share = place.share;
  push.normal_W = X_WS.q * found.gradient.normalized();
  push.lever_W = p_W - place.X_WT.p;
  if (is_touching) {
    if (!candidate.is_bend_known) candidate.bend_S = bend(field, p_S);
    candidate.is_bend_known = true;
    const Eigen::Matrix3d R_WS = X_WS.q.toRotationMatrix();
    push.bend_W = R_WS * candidate.bend_S * R_WS.transpose();
    push.size = -found.distance_m / candidate.mobility;
    candidate.normal_sum += push.size;
    apply(candidate, push.size * push.normal_W, p_W, reactions);
    pushes_.push_back(push);
  }
  rub(thing, candidate, push, reactions);
}

void SoftStep::rub(const SoftThing& thing, Candidate& candidate, SoftPush push, std::span<SoftReaction> reactions) {
  push.friction = std::sqrt(thing.friction * body_.model().traits.friction);
  if (push.friction <= 0) return;
  const Vec3 p_W = body_.position(body_.model().samples[static_cast<std::size_t>(candidate.sample)]);
  const Vec3 stuck_W = places_[static_cast<std::size_t>(candidate.thing)].X_WT * candidate.p_T_start;
  const Vec3 slip_W = p_W - stuck_W;
  const Vec3 along_W = slip_W - push.normal_W * push.normal_W.dot(slip_W);
  const Vec3 wanted_W = candidate.friction_sum_W - along_W / candidate.mobility;
  const double limit = push.friction * candidate.normal_sum, wanted = wanted_W.norm();
  push.kind = wanted > limit ? SoftPush::Kind::kSlide : SoftPush::Kind::kStick;
  Vec3 allowed_W = wanted_W;
  if (wanted > limit) {
    push.slide_W = wanted_W / wanted;
    push.slide_share = limit / wanted;
    allowed_W = limit * push.slide_W;
  }
  apply(candidate, allowed_W - candidate.friction_sum_W, p_W, reactions);
  candidate.friction_sum_W = allowed_W;
  pushes_.push_back(push);
}

}  // namespace tandem::server

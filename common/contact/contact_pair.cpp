#include "common/contact/contact_pair.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace tandem {
namespace {

// A shell wider than this is not trusted to find all there is: the accuracy that contact promises.
constexpr double kFineSpacing_m = 5e-4;

double area_m2(const ContactShape& shape) {
  return shape.shells.surface.nodes.empty() ? 0 : shape.shells.surface.nodes[0].mean.area_m2;
}

bool is_fine(const ContactShape& shape) {
  return shape.shells.surface.spacing_m <= kFineSpacing_m && !shape.shells.surface.nodes.empty();
}

// Whether `a` gives all of its points first.
bool is_primary(const ContactShape& a, const ContactShape& b) {
  if (is_fine(a) != is_fine(b)) return is_fine(a);
  return area_m2(a) <= area_m2(b);
}

BoundingBall ball_around(const ContactShape& shape) {
  // The surface bulges out of the box around its points by less than the way to the next of them.
  return {(shape.low_S + shape.high_S) / 2, (shape.high_S - shape.low_S).norm() / 2 + shape.shells.surface.spacing_m};
}

}  // namespace

/// Points of one shape (frame P) against the field of the other (frame F).
struct ContactPair::Direction {
  const DistanceField& field;
  Pose X_WF;
  Pose X_FP;
  std::uint32_t id_bits = 0;
  double sign = 1;   ///< of the field's gradient, so that it points out of B
  double share = 1;  ///< of the points' area
};

/// A direction as matrices.
struct ContactPair::Placing {
  Placing(const Direction& direction, double band)
      : field(direction.field),
        R_FP(direction.X_FP.q.toRotationMatrix()),
        p_FP(direction.X_FP.p),
        R_WF(direction.X_WF.q.toRotationMatrix()),
        p_WF(direction.X_WF.p),
        R_out(direction.sign * R_WF),
        id_bits(direction.id_bits),
        share(direction.share),
        band_m(band) {}
  Vec3 in_field(const Eigen::Vector3f& p_P) const { return R_FP * p_P.cast<double>() + p_FP; }

  const DistanceField& field;
  Eigen::Matrix3d R_FP;
  Vec3 p_FP;
  Eigen::Matrix3d R_WF;
  Vec3 p_WF;
  Eigen::Matrix3d R_out;
  std::uint32_t id_bits;
  double share;
  double band_m;
};

ContactPair::ContactPair(const ContactBudget& budget)
    : budget_(std::max(8U, budget.points)), primary_(budget_), other_(budget_ / 2) {
  for (Found* found : {&now_, &before_}) {
    found->points.reserve(budget_);
    found->counts.reserve(budget_);
  }
}

void ContactPair::bind(const ContactShape* a, const ContactShape* b) noexcept {
  a_ = a;
  b_ = b;
  for (Found* found : {&now_, &before_}) {
    found->points.clear();
    found->counts.clear();
    found->first_of_other = 0;
  }
  if (!is_bound()) return;
  is_a_primary_ = is_primary(*a, *b);
  const ContactShape& first = is_a_primary_ ? *a : *b;
  const ContactShape& second = is_a_primary_ ? *b : *a;
  // A blunt tip that goes in between the other's points is deep as seen from its own points alone: where both shells are
  // fine, each gives all of its points, for half of their area.
  is_mutual_ = is_fine(*a) && is_fine(*b);
  const PointShell& others = is_mutual_ ? second.shells.surface : second.shells.features;
  const std::uint32_t for_others = others.nodes.empty() ? 0 : budget_ / (is_mutual_ ? 2 : 4);
  primary_.bind(&first.shells.surface, ball_around(first), second.field.get(), ball_around(second),
                budget_ - for_others);
  other_.bind(&others, ball_around(second), first.field.get(), ball_around(first), for_others);
}

ContactWork ContactPair::find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept {
  std::swap(now_, before_);
  now_.points.clear();
  now_.counts.clear();
  now_.first_of_other = 0;
  if (!is_bound() || !is_finite(X_WA) || !is_finite(X_WB)) return {};

  const Pose X_BA = X_WB.inverse() * X_WA;
  const Pose X_AB = X_WA.inverse() * X_WB;
  const double share = is_mutual_ ? 0.5 : 1;
  const Direction a_in_b{*b_->field, X_WB, X_BA, is_a_primary_ ? 0 : ContactPoint::kOtherDirection, 1, share};
  const Direction b_in_a{*a_->field, X_WA, X_AB, is_a_primary_ ? ContactPoint::kOtherDirection : 0, -1, share};
  const Direction& first = is_a_primary_ ? a_in_b : b_in_a;
  const Direction& second = is_a_primary_ ? b_in_a : a_in_b;

  ContactWork work = primary_.refresh(first.X_FP, band_m);
  work += other_.refresh(second.X_FP, band_m);
  work += search(primary_, first, band_m);
  now_.first_of_other = now_.points.size();
  work += search(other_, second, band_m);

  const Eigen::Matrix3d turn = (X_WB.q * q_WB_before_.conjugate()).toRotationMatrix();
  carry_bristles(0, now_.first_of_other, 0, before_.first_of_other, turn);
  carry_bristles(now_.first_of_other, now_.points.size(), before_.first_of_other, before_.points.size(), turn);
  q_WB_before_ = X_WB.q;
  return work;
}

// With more contacts than fit, again with fewer; a coarse list always fits.
ContactWork ContactPair::search(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept {
  ContactWork work;
  const std::size_t begin = now_.points.size();
  while (!search_parts(candidates, direction, band_m)) {
    now_.points.resize(begin);
    now_.counts.resize(begin);
    work += candidates.shorten(band_m);
  }
  const auto counts = now_.counts.begin() + static_cast<std::ptrdiff_t>(begin);
  candidates.count_points(std::accumulate(counts, now_.counts.end(), std::size_t{0}));
  return work;
}

bool ContactPair::search_parts(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept {
  room_end_ = now_.points.size() + candidates.capacity();
  const Placing placing(direction, band_m);
  for (ShellPart& part : candidates.parts()) {
    const auto reach_m = static_cast<float>(candidates.reach_m(part, band_m));
    if (part.due_m > reach_m) continue;
    float due_m = std::numeric_limits<float>::infinity();
    for (ShellCandidate& candidate : candidates.candidates(part)) {
      if (candidate.nearest_m <= reach_m && !look_at(candidates, part, candidate, placing)) return false;
      due_m = std::min(due_m, candidate.nearest_m);
    }
    part.due_m = due_m;
  }
  return true;
}

// False: there is no room.
bool ContactPair::look_at(const ShellCandidates& candidates, const ShellPart& part, ShellCandidate& candidate,
                          const Placing& placing) noexcept {
  const Vec3 p_F = placing.in_field(candidate.p_P);
  const DistanceSample sample = placing.field.sample(p_F);
  if (candidate.kind == ShellCandidate::Kind::kFlatLeaf) {
    const ShellNode& leaf = candidates.shell()->nodes[candidate.node];
    const Vec3 normal_F = placing.R_FP * leaf.mean.normal_S.cast<double>();
    const double rise_m = leaf.radius_m * normal_F.cross(sample.gradient).norm();
    const bool is_flat = candidates.is_flat(sample.distance_m - rise_m, sample.distance_m + rise_m);
    if (!is_flat || candidate.whole_m < part.travel_m) return look_at_points(candidates, leaf, placing);
  } else {
    candidates.note(part, candidate, sample.distance_m);
  }
  return add(placing, p_F, sample, candidate.area_m2, candidate.first, candidate.count);
}

bool ContactPair::look_at_points(const ShellCandidates& candidates, const ShellNode& leaf,
                                 const Placing& placing) noexcept {
  for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    const ShellPoint& point = candidates.shell()->points[i];
    const Vec3 p_F = placing.in_field(point.p_S);
    if (!add(placing, p_F, placing.field.sample(p_F), point.area_m2, i, 1)) return false;
  }
  return true;
}

bool ContactPair::add(const Placing& placing, const Vec3& p_F, const DistanceSample& sample, float area_m2,
                      std::uint32_t first, std::uint32_t count) noexcept {
  if (sample.distance_m >= placing.band_m) return true;
  if (now_.points.size() == room_end_) return false;
  ContactPoint& point = now_.points.emplace_back();
  point.p_W = placing.R_WF * p_F + placing.p_WF;
  point.normal_W = placing.R_out * sample.gradient.normalized();
  point.depth_m = -sample.distance_m;
  point.area_m2 = placing.share * area_m2;
  point.id = first | placing.id_bits;
  now_.counts.push_back(count);
  return true;
}

// Both lists are in the order of their points. What stands for several points takes the mean of what they had, and
// gives it to each of them: friction does not let go where contact gets coarser or finer.
void ContactPair::carry_bristles(std::size_t now, std::size_t now_end, std::size_t before, std::size_t before_end,
                                 const Eigen::Matrix3d& turn_of_b) noexcept {
  for (; now < now_end; ++now) {
    ContactPoint& point = now_.points[now];
    const std::uint32_t end = point.id + now_.counts[now];
    while (before < before_end && before_.points[before].id + before_.counts[before] <= point.id) ++before;
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (std::size_t old = before; old < before_end && before_.points[old].id < end; ++old) {
      const std::uint32_t overlap_end = std::min(end, before_.points[old].id + before_.counts[old]);
      const double weight = overlap_end - std::max(point.id, before_.points[old].id);
      sum += weight * before_.points[old].bristle_W;
      weights += weight;
    }
    if (weights <= 0) continue;
    const Vec3 bristle_W = turn_of_b * sum / weights;
    point.bristle_W = bristle_W - point.normal_W * point.normal_W.dot(bristle_W);
  }
}

}  // namespace tandem

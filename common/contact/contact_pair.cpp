#include "common/contact/contact_pair.hpp"

#include <algorithm>
#include <utility>

#include "common/contact/flat/plane_contacts.hpp"

namespace tandem::contact {
namespace {

// A shell wider than this is not trusted to find all there is: the accuracy that contact promises.
constexpr double kFineSpacing_m = 5e-4;
// Candidates keep distances in single precision.
constexpr double kRounding_m = 1e-8;

double area_m2(const ContactShape& shape) {
  return shape.shells.surface.nodes.empty() ? 0 : shape.shells.surface.nodes[0].mean.area_m2;
}

bool is_fine(const ContactShape& shape) {
  return shape.shells.surface.spacing_m <= kFineSpacing_m && !shape.shells.surface.nodes.empty();
}

// Most fields answer with a unit vector: a root and three quotients a point are saved.
Vec3 unit(const Vec3& a) {
  return a.squaredNorm() == 1 ? a : a.normalized();
}

// Whether `a` gives all of its points first.
bool is_primary(const ContactShape& a, const ContactShape& b) {
  if (is_fine(a) != is_fine(b)) return is_fine(a);
  return area_m2(a) <= area_m2(b);
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

ContactPair::ContactPair(std::uint32_t budget) : budget_(std::max(8U, budget)), primary_(budget_), other_(budget_ / 2) {
  now_.reserve(budget_ + kSmallNode);
  before_.reserve(budget_ + kSmallNode);
}

void ContactPair::bind(const ContactShape* a, const ContactShape* b) noexcept {
  a_ = a;
  b_ = b;
  now_.clear();
  before_.clear();
  first_of_other_ = first_of_other_before_ = 0;
  if (!is_bound()) return;
  is_a_primary_ = is_primary(*a, *b);
  const ContactShape& first = is_a_primary_ ? *a : *b;
  const ContactShape& second = is_a_primary_ ? *b : *a;
  // A blunt tip that goes in between the other's points is deep as seen from its own points alone: where both shells
  // are fine, each gives all of its points, for half of their area.
  is_mutual_ = is_fine(*a) && is_fine(*b);
  const PointShell& others = is_mutual_ ? second.shells.surface : second.shells.features;
  const std::uint32_t for_others = others.nodes.empty() ? 0 : budget_ / (is_mutual_ ? 2 : 4);
  primary_.bind(first.shells.surface, first, second, budget_ - for_others);
  other_.bind(others, second, first, for_others);
}

ContactWork ContactPair::find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept {
  std::swap(now_, before_);
  now_.clear();
  first_of_other_before_ = std::exchange(first_of_other_, 0);
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
  search(primary_, first, band_m);
  first_of_other_ = now_.size();
  search(other_, second, band_m);

  const Eigen::Matrix3d turn = (X_WB.q * q_WB_before_.conjugate()).toRotationMatrix();
  carry_bristles(0, first_of_other_, 0, first_of_other_before_, turn);
  carry_bristles(first_of_other_, now_.size(), first_of_other_before_, before_.size(), turn);
  q_WB_before_ = X_WB.q;
  return work;
}

void ContactPair::search(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept {
  const Eigen::Matrix3d R_FP = direction.X_FP.q.toRotationMatrix();
  const Eigen::Matrix3d R_WF = direction.X_WF.q.toRotationMatrix();
  const Eigen::Matrix3d R_out = direction.sign * R_WF;
  const double rigid_depth_m = std::min(a_->rigid_depth_m, b_->rigid_depth_m);
  PlaneContacts planes{candidates.shell(),
                       direction.field.planes(),
                       direction.X_FP,
                       direction.X_WF * direction.X_FP,
                       R_WF,
                       band_m,
                       rigid_depth_m,
                       direction.share,
                       direction.sign,
                       direction.id_bits,
                       candidates.room()};
  const double margin_m = band_m + 2 * direction.field.error_m() + kRounding_m;
  for (const ShellPart& part : candidates.parts()) {
    for (const ShellCandidate& candidate : candidates.candidates(part)) {
      if (candidate.distance_m > margin_m + part.motion_m) continue;
      if (candidate.planes != 0) {
        planes.add(candidate.node, candidate.planes, now_);
        continue;
      }
      const Vec3 p_F = R_FP * candidate.p_P.cast<double>() + direction.X_FP.p;
      const DistanceSample sample = direction.field.sample(p_F);
      if (sample.distance_m >= band_m) continue;
      ContactPoint& point = now_.emplace_back();
      point.p_W = R_WF * p_F + direction.X_WF.p;
      point.normal_W = R_out * unit(sample.gradient);
      point.depth_m = -sample.distance_m;
      point.area_m2 = direction.share * candidate.area_m2;
      point.id = candidate.first | direction.id_bits;
      point.count = candidate.count;
    }
  }
}

// Both lists are in the order of their points. What stands for several points takes the mean of what they had, and
// gives it to each of them: friction does not let go where contact gets coarser or finer.
void ContactPair::carry_bristles(std::size_t now, std::size_t now_end, std::size_t before, std::size_t before_end,
                                 const Eigen::Matrix3d& turn_of_b) noexcept {
  for (; now < now_end; ++now) {
    ContactPoint& point = now_[now];
    const std::uint32_t end = point.id + point.count;
    while (before < before_end && before_[before].id + before_[before].count <= point.id) ++before;
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (std::size_t i = before; i < before_end && before_[i].id < end; ++i) {
      const ContactPoint& old = before_[i];
      const double weight = std::min(end, old.id + old.count) - std::max(point.id, old.id);
      sum += weight * old.bristle_W;
      weights += weight;
    }
    // What did not press has none.
    if (weights <= 0 || sum == Vec3::Zero()) continue;
    const Vec3 bristle_W = turn_of_b * sum / weights;
    point.bristle_W = bristle_W - point.normal_W * point.normal_W.dot(bristle_W);
  }
}

}  // namespace tandem::contact

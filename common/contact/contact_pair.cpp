#include "common/contact/contact_pair.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/contact/field/oriented_box.hpp"
#include "common/contact/flat/plane_contacts.hpp"

namespace tandem::contact {
namespace {

// Largest spacing of a shell's points [m] at which the shell alone is fine enough to find contacts.
constexpr double kFineSpacing_m = 5e-4;
// Amount by which the depth of a late-found contact may grow in a step [m], in addition to the contact's motion. At 1
// kHz it is 10 mm/s. A contact is found late if an earlier search has missed it because of the budget.
constexpr double kPushOut_m = 1e-5;

// If the cosine of the angle between a plane's normal and the sample's gradient is below this value, the plane belongs
// to the far side of a thin wall.
constexpr double kFarSideCosine = -0.5;

double area_m2(const ContactShape& shape) {
  return shape.shells.surface.nodes.empty() ? 0 : shape.shells.surface.nodes[0].mean.area_m2;
}

bool is_fine(const ContactShape& shape) {
  return shape.shells.surface.spacing_m <= kFineSpacing_m && !shape.shells.surface.nodes.empty();
}

// Normalises a gradient. Most fields return a unit gradient, for which the square root and three divisions are skipped.
Vec3 unit(const Vec3& a) {
  return a.squaredNorm() == 1 ? a : a.normalized();
}

// Returns whether `a` is the primary shape of a pair. All points of the primary shape are sampled in the field of the
// secondary one, which may contribute only feature points.
bool is_primary(const ContactShape& a, const ContactShape& b) {
  if (is_fine(a) != is_fine(b)) return is_fine(a);
  return area_m2(a) <= area_m2(b);
}

}  // namespace

/// One direction of the search: points of one shape (frame P) are sampled in the field of the other (frame F).
struct ContactPair::Direction {
  const DistanceField& field;
  Pose X_WF;
  Pose X_FP;
  std::uint32_t id_bits = 0;
  double sign = 1;         ///< factor ±1 that turns the field's gradient so that it points out of B
  double share = 1;        ///< fraction of a point's area that counts
  double plane_share = 1;  ///< fraction that counts instead if the point is at a plane of the field

  /// Returns the plane that replaces the field at a point: its distance equals the field's distance, which must be 0 or
  /// negative. Returns null if there is no such plane.
  const FieldPlane* plane_at(const Vec3& p_F) const noexcept {
    const std::span<const FieldPlane> planes = field.planes();
    if (planes.empty()) return nullptr;
    const FieldPlane* largest = nullptr;
    for (PlaneSet rest = field.planes_at(p_F); rest != 0; rest &= rest - 1) {
      const FieldPlane& plane = planes[static_cast<std::size_t>(std::countr_zero(rest))];
      if (largest == nullptr || plane.distance_m(p_F) > largest->distance_m(p_F)) largest = &plane;
    }
    return largest;
  }
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
  deepest_m_ = std::numeric_limits<double>::infinity();
  is_catching_up_ = false;
  first_of_other_ = first_of_other_before_ = 0;
  if (!is_bound()) return;
  is_a_primary_ = is_primary(*a, *b);
  const ContactShape& first = is_a_primary_ ? *a : *b;
  const ContactShape& second = is_a_primary_ ? *b : *a;
  // If both shapes have fine points, both contribute all of them, each with half of its area. With the points of the
  // other shape only, a blunt tip could enter between them and no point would be deep.
  is_mutual_ = is_fine(*a) && is_fine(*b);
  const PointShell& others = is_mutual_ ? second.surface_off_planes() : second.shells.features;
  const std::uint32_t for_others = others.nodes.empty() ? 0 : budget_ / (is_mutual_ ? 2 : 4);
  plane_share_ = is_mutual_ && !second.off_planes ? 0.5 : 1;
  const double share = is_mutual_ ? 0.5 : 0;
  closed_form_.bind(a, b, is_a_primary_ ? plane_share_ : share, is_a_primary_ ? share : plane_share_);
  primary_.bind(first.shells.surface, first, second, budget_ - for_others);
  other_.bind(others, second, first, for_others);
}

ContactWork ContactPair::find(const Pose& X_WA, const Pose& X_WB, double band_m) noexcept {
  std::swap(now_, before_);
  now_.clear();
  first_of_other_before_ = std::exchange(first_of_other_, 0);
  closed_form_.begin_step();
  if (!is_bound() || !is_finite(X_WA) || !is_finite(X_WB)) return {};
  const auto turn_since = [](const Quat& q, Quat& before) {
    return (q * std::exchange(before, q).conjugate()).toRotationMatrix();
  };
  const Eigen::Matrix3d turn_of_a = turn_since(X_WA.q, q_WA_before_);
  turn_of_b_ = turn_since(X_WB.q, q_WB_before_);
  const Eigen::Matrix3d& turn_of_b = turn_of_b_;
  const Eigen::Matrix3d& turn_of_plane = closed_form_.is_ball_b() ? turn_of_a : turn_of_b;
  if (closed_form_.find(X_WA, X_WB, band_m, now_)) {
    first_of_other_ = now_.size();
    deepest_m_ = std::numeric_limits<double>::infinity();
    closed_form_.carry_bristles(before_, now_, turn_of_plane);
    return {};
  }

  const Pose X_BA = X_WB.inverse() * X_WA;
  const Pose X_AB = X_WA.inverse() * X_WB;
  if (!is_finite(X_BA) || !is_finite(X_AB)) return {};
  const double share = is_mutual_ ? 0.5 : 1;
  const std::uint32_t bits_of_a = is_a_primary_ ? 0 : ContactPoint::kOtherDirection;
  const std::uint32_t bits_of_b = is_a_primary_ ? ContactPoint::kOtherDirection : 0;
  const Direction a_in_b{*b_->field, X_WB, X_BA, bits_of_a, 1, share, is_a_primary_ ? plane_share_ : share};
  const Direction b_in_a{*a_->field, X_WA, X_AB, bits_of_b, -1, share, is_a_primary_ ? share : plane_share_};
  const Direction& first = is_a_primary_ ? a_in_b : b_in_a;
  const Direction& second = is_a_primary_ ? b_in_a : a_in_b;

  ContactWork work = primary_.refresh(first.X_FP, band_m);
  work += other_.refresh(second.X_FP, band_m);
  search(primary_, first, band_m);
  first_of_other_ = now_.size();
  search(other_, second, band_m);
  limit_depths(X_WA, X_WB, X_BA, work.is_coarse);

  if (closed_form_.had_contacts()) {
    share_bristles(before_, now_, turn_of_plane);
    return work;
  }
  carry_bristles(0, first_of_other_, 0, first_of_other_before_, turn_of_b);
  carry_bristles(first_of_other_, now_.size(), first_of_other_before_, before_.size(), turn_of_b);
  return work;
}

// Limits the depth of contacts that an earlier search missed because it was coarse, that is, limited by the budget to
// some of the points. The full depth of such a contact in one step would throw the shapes apart.
// A contact counts as missed if its depth has grown by more than it moved. The depth is compared with two depths of the
// previous step: that of the same points, and the largest of all contacts.
//
// Beyond the rigid depth (where contact is as stiff as the step allows), the limit grows by the contact's motion only.
// The contact then stops further motion but does not push out. Otherwise, if a thin wall is pierced, the contacts of
// both of its faces would accelerate the bodies.
void ContactPair::limit_depths(const Pose& X_WA, const Pose& X_WB, const Pose& X_BA, bool is_coarse) noexcept {
  const Pose X_BA_before = std::exchange(X_BA_before_, X_BA);
  const double deepest_before_m = std::exchange(deepest_m_, 0);
  const bool was_coarse = std::exchange(is_catching_up_, is_coarse);
  const bool is_limited = (is_coarse || was_coarse) && std::isfinite(deepest_before_m);
  const double most_m = std::min(deepest_before_m + kPushOut_m, std::min(a_->rigid_depth_m, b_->rigid_depth_m));
  for (ContactPoint& point : now_) {
    if (is_limited && point.depth_m > most_m) {
      const Vec3 before_W = X_WB * (X_BA_before * (X_WA.inverse() * point.p_W));
      const double moved_m = point.normal_W.dot(before_W - point.p_W), in_m = std::max(0.0, moved_m);
      // For an unchanged normal, motion outwards reduces the limit. Otherwise, each repetition of a motion in and out
      // would raise it.
      const ContactPoint* const old = deepest_before(point);
      const bool has_turned = old != nullptr && old->normal_W.dot(point.normal_W) < 0.5;
      const double limit_m = std::max(most_m + in_m, old == nullptr ? 0 : old->depth_m + (has_turned ? in_m : moved_m));
      is_catching_up_ = is_catching_up_ || point.depth_m > limit_m;
      point.depth_m = std::min(point.depth_m, limit_m);
    }
    deepest_m_ = std::max(deepest_m_, point.depth_m);
  }
}

// Returns the deepest contact of the previous find() that represents some of the same points; null if there is none.
const ContactPoint* ContactPair::deepest_before(const ContactPoint& point) const noexcept {
  const bool is_other = (point.id & ContactPoint::kOtherDirection) != 0;
  const auto all = std::span(before_);
  const auto before = is_other ? all.subspan(first_of_other_before_) : all.first(first_of_other_before_);
  const auto ends_first = [&](const ContactPoint& old) { return old.id + old.count <= point.id; };
  const ContactPoint* deepest = nullptr;
  for (auto old = std::ranges::partition_point(before, ends_first);
       old != before.end() && old->id < point.id + point.count; ++old) {
    if (deepest == nullptr || old->depth_m > deepest->depth_m) deepest = &*old;
  }
  return deepest;
}

std::span<const ShellPoint> ContactPair::points_of(const ContactPoint& contact) const noexcept {
  if ((contact.id & ContactPoint::kClosedForm) != 0) return {};
  const bool is_other = (contact.id & ContactPoint::kOtherDirection) != 0;
  const PointShell& shell = is_other ? other_.shell() : primary_.shell();
  return std::span(shell.points).subspan(contact.id & ~ContactPoint::kOtherDirection, contact.count);
}

void ContactPair::search(ShellCandidates& candidates, const Direction& direction, double band_m) noexcept {
  const Pose X_WP = direction.X_WF * direction.X_FP;
  const Eigen::Matrix3d R_WP = X_WP.q.toRotationMatrix();
  const Eigen::Matrix3d R_WF = direction.X_WF.q.toRotationMatrix();
  const Eigen::Matrix3d R_out = direction.sign * R_WF;
  const double rigid_depth_m = std::min(a_->rigid_depth_m, b_->rigid_depth_m);
  PlaneContacts planes{candidates.shell(),
                       direction.field.planes(),
                       direction.X_FP,
                       X_WP,
                       R_WF,
                       band_m,
                       rigid_depth_m,
                       direction.plane_share,
                       direction.sign,
                       direction.id_bits,
                       candidates.room(),
                       candidates.more_contacts()};
  for (const ShellCandidate& candidate : candidates.candidates()) {
    if (candidate.planes != 0) {
      planes.add(candidate.node, candidate.planes, now_);
      continue;
    }
    ContactPoint& contact = now_.emplace_back();
    contact.p_W = R_WP * candidate.p_P.cast<double>() + X_WP.p;
    contact.normal_W = R_out * unit(candidate.gradient_F);
    contact.depth_m = -candidate.distance_m;
    contact.area_m2 = direction.share * candidate.area_m2;
    contact.id = candidate.first | direction.id_bits;
    contact.count = candidate.count;
    const Vec3 p_F = direction.X_FP * candidate.p_P.cast<double>();
    const FieldPlane* const plane = direction.plane_at(p_F);
    if (plane == nullptr) continue;
    contact.area_m2 = direction.plane_share * candidate.area_m2;
    // The plane's depth and normal replace those of the samples, which round off the edges between planes. Exception:
    // in a thin wall, the sample may belong to the near face but the plane to the far face.
    if (plane->distance_m(p_F) > 0 || plane->normal.dot(unit(candidate.gradient_F)) < kFarSideCosine) continue;
    contact.normal_W = R_out * plane->normal;
    contact.depth_m = -plane->distance_m(p_F);
  }
}

// Transfers the bristles (friction state) from the contacts of the last find() to those of the same points. Both lists
// are in the order of their points. A contact for several points gets the mean of their bristles. If it is replaced
// later by contacts for single points, each of these gets the contact's bristle. Friction thus persists when contacts
// are merged or divided.
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
    // Only contacts that pressed have a bristle.
    if (weights <= 0 || sum == Vec3::Zero()) continue;
    const Vec3 bristle_W = turn_of_b * sum / weights;
    point.bristle_W = bristle_W - point.normal_W * point.normal_W.dot(bristle_W);
  }
}

}  // namespace tandem::contact

#include "common/contact/closed_form_contacts.hpp"

#include <algorithm>
#include <utility>

#include "common/contact/field/oriented_box.hpp"
#include "common/contact/flat/ball_contacts.hpp"

namespace tandem::contact {
namespace {

// Margin added around a ball for the box of a plane query. The result is reused until the ball has moved by more than
// this margin.
constexpr double kBallSlack_m = 1e-3;
// In each step, the core of a contact (area that has pressed since the contact began) grows by this fraction of the
// ring (area that was added later). After 100 steps, 63 % of a new ring thus belong to the core.
constexpr double kCoreGrowth = 1e-2;

}  // namespace

void ClosedFormContacts::bind(const ContactShape* a, const ContactShape* b, double share_of_a,
                              double share_of_b) noexcept {
  a_ = a;
  b_ = b;
  ball_ = nullptr;
  if (a->ball_radius_m > 0 && !b->field->planes().empty()) ball_ = a;
  if (b->ball_radius_m > 0 && !a->field->planes().empty()) ball_ = b;
  ball_share_ = is_ball_a() ? share_of_a : share_of_b;
  is_on_ = nullptr;
  are_rods_ = a->rod.is_thin() && b->rod.is_thin();
  has_rods_ = false;
  rods_.forget();
  ball_planes_reach_m_ = -1;
}

void ClosedFormContacts::begin_step() noexcept {
  was_on_ = std::exchange(is_on_, nullptr);
  had_rods_ = std::exchange(has_rods_, false);
}

bool ClosedFormContacts::find(const Pose& X_WA, const Pose& X_WB, double band_m,
                              std::vector<ContactPoint>& now) noexcept {
  if (ball_ != nullptr && add_ball(X_WA, X_WB, band_m, now)) return true;
  has_rods_ = are_rods_ && rods_.find(a_->rod, X_WA, b_->rod, X_WB, band_m, is_ball_a(), now);
  return has_rods_;
}

// Appends the contacts of a ball with the plane near it. For a ball out of reach, returns true and appends none.
// Returns false if several planes are near the ball, or if the field has no planes there. The shells must then be
// searched.
bool ClosedFormContacts::add_ball(const Pose& X_WA, const Pose& X_WB, double band_m,
                                  std::vector<ContactPoint>& now) noexcept {
  const bool is_ball_a = this->is_ball_a();
  const DistanceField& field = is_ball_a ? *b_->field : *a_->field;
  const Pose& X_WF = is_ball_a ? X_WB : X_WA;
  const Vec3 centre_F = X_WF.inverse() * (is_ball_a ? X_WA.p : X_WB.p);
  const double radius_m = ball_->ball_radius_m;
  if (field.distance_m(centre_F) - field.error_m() > radius_m + band_m) return true;
  const PlaneSet planes = planes_around_ball(field, centre_F, radius_m + band_m);
  is_on_ = plane_below_ball(field, planes, centre_F, radius_m, band_m);
  if (is_on_ == nullptr) return false;
  add_ball_on_plane(*is_on_, X_WF, centre_F, radius_m, band_m, ball_share_, is_ball_a ? 1 : -1, now);
  return true;
}

// Returns the planes around a ball. A query of a grid takes microseconds, so results are reused: the queried box has a
// margin, and its result holds while it contains the box around the ball. An empty result is reused only if the queried
// box is not much larger than the box around the ball, because a smaller box might have planes.
PlaneSet ClosedFormContacts::planes_around_ball(const DistanceField& field, const Vec3& centre_F,
                                                double reach_m) noexcept {
  const double moved_m = (centre_F - ball_planes_centre_F_).cwiseAbs().maxCoeff();
  const bool is_in = moved_m + reach_m <= ball_planes_reach_m_;
  const bool is_tight = ball_planes_reach_m_ <= reach_m + 2 * kBallSlack_m;
  if (is_in && (is_tight || ball_planes_ != 0)) return ball_planes_;
  ball_planes_centre_F_ = centre_F;
  ball_planes_reach_m_ = reach_m + kBallSlack_m;
  const OrientedBox box{centre_F, Eigen::Matrix3d::Identity(), Vec3::Constant(ball_planes_reach_m_)};
  std::size_t queries = 0;
  ball_planes_ = field.planes_over(box, queries);
  return ball_planes_;
}

void ClosedFormContacts::carry_bristles(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                                        const Eigen::Matrix3d& turn) noexcept {
  if (is_on_ == was_on_ && has_rods_ == had_rods_) return carry_each(before, now, turn);
  share_bristles(before, now, turn);
  for (const ContactPoint& point : now) keep_core(point, point.bristle_W, point.area_m2);
}

// Transfers the bristles (friction state) from the contacts of the last find() to contacts with the same id. Newly
// added area has no bristle. The area of a contact consists of a core and of a ring that was added later (see
// ClosedFormContacts). When the area shrinks, the ring is reduced first. Area that presses all the time thus keeps its
// friction even if the force fluctuates.
void ClosedFormContacts::carry_each(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                                    const Eigen::Matrix3d& turn) noexcept {
  std::size_t i = 0;
  for (ContactPoint& point : now) {
    while (i < before.size() && before[i].id < point.id) ++i;
    if (i == before.size() || before[i].id != point.id || before[i].bristle_W == Vec3::Zero()) {
      keep_core(point, Vec3::Zero(), point.area_m2);
      continue;
    }
    const ContactPoint& old = before[i];
    const std::size_t slot = point.id & ~ContactPoint::kClosedForm;
    const Vec3 lead_W = turn * core_leads_W_[slot], old_W = turn * old.bristle_W;
    const double old_core_m2 = core_areas_m2_[slot], old_ring_m2 = old.area_m2 - old_core_m2;
    double core_m2 = std::min(old_core_m2, point.area_m2);
    const double ring_m2 = point.area_m2 - core_m2;
    Vec3 core_W = core_m2 * (old_W + lead_W);  // core_W and ring_W are bristles × area
    Vec3 ring_W = Vec3::Zero();
    if (old_ring_m2 > 0) ring_W = std::min(1.0, ring_m2 / old_ring_m2) * (old_ring_m2 * old_W - old_core_m2 * lead_W);
    point.bristle_W = (core_W + ring_W) / point.area_m2;
    core_W += kCoreGrowth * ring_W;
    core_m2 += kCoreGrowth * ring_m2;
    keep_core(point, core_W / core_m2, core_m2);
  }
}

void ClosedFormContacts::keep_core(const ContactPoint& point, const Vec3& core_bristle_W,
                                   double core_area_m2) noexcept {
  const std::size_t slot = point.id & ~ContactPoint::kClosedForm;
  core_leads_W_[slot] = core_bristle_W - point.bristle_W;
  core_areas_m2_[slot] = core_area_m2;
}

void share_bristles(std::span<const ContactPoint> before, std::span<ContactPoint> now,
                    const Eigen::Matrix3d& turn) noexcept {
  const auto weight = [](const ContactPoint& point) { return point.area_m2 * std::max(0.0, point.depth_m); };
  const auto centre_of = [&](std::span<const ContactPoint> points) {
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (const ContactPoint& point : points) {
      sum += weight(point) * point.p_W;
      weights += weight(point);
    }
    return std::pair<Vec3, double>(weights > 0 ? Vec3(sum / weights) : sum, weights);
  };
  const auto [old_centre_W, old_weights] = centre_of(before);
  const auto [centre_W, weights] = centre_of(now);
  if (!(old_weights > 0 && weights > 0)) return;
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero(), normal = Vec3::Zero();
  for (const ContactPoint& old : before) {
    force += old.area_m2 * (turn * old.bristle_W);
    moment += old.area_m2 * (turn * (old.p_W - old_centre_W).cross(old.bristle_W));
  }
  for (const ContactPoint& point : now) normal += weight(point) * point.normal_W;
  normal.normalize();
  double spread = 0;
  for (const ContactPoint& point : now) spread += weight(point) * (point.p_W - centre_W).cross(normal).squaredNorm();
  const Vec3 twist = spread > 0 ? Vec3(normal.dot(moment) / spread * normal) : Vec3::Zero();
  for (ContactPoint& point : now) {
    const Vec3 bristle_W = std::max(0.0, point.depth_m) * (force / weights + twist.cross(point.p_W - centre_W));
    point.bristle_W = bristle_W - point.normal_W * point.normal_W.dot(bristle_W);
  }
}

}  // namespace tandem::contact

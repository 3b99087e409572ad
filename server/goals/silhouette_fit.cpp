#include "server/goals/silhouette_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tandem::server {
namespace {

constexpr double kRest_m_per_s = 0.02, kRest_rad_per_s = 10 * std::numbers::pi / 180;
constexpr int kAngles = 24;
constexpr int kStepsBetweenSearches = 100;  ///< steps of the room between two searches
constexpr double kFirstStep = 0.1;          ///< first step of the pattern search: 10 % of the figure's size, or 0.1 rad
constexpr double kLastStep = 1e-3;

}  // namespace

SilhouetteFit::SilhouetteFit(const SilhouettePlan& plan) : plan_(plan), size_m_(std::sqrt(plan.figure_area_m2)) {}

void SilhouetteFit::reset() noexcept {
  placements_ = -1;
  waited_ = 0;
  is_covered_ = false;
}

void SilhouetteFit::advance(std::span<const RigidState> bodies, std::uint64_t absent) noexcept {
  if (!rest(bodies, absent)) return reset();
  if (placements_ < 0) {
    if (++waited_ >= kStepsBetweenSearches) begin(bodies);
  } else if (placements_ < kAngles) {
    try_start();
  } else {
    try_pattern();
  }
}

bool SilhouetteFit::rest(std::span<const RigidState> bodies, std::uint64_t absent) const noexcept {
  return std::ranges::all_of(plan_.pieces, [bodies, absent](const SilhouettePlan::Piece& piece) {
    const Twist& V = bodies[piece.body].V;
    return (absent >> piece.body & 1U) == 0 && V.v.norm() < kRest_m_per_s && V.w.norm() < kRest_rad_per_s;
  });
}

/// Starts a search. Computes the outlines of the boards, as seen from above, at their current poses. The outline of a
/// board that lies upside down is clockwise, so its order is reversed.
void SilhouetteFit::begin(std::span<const RigidState> bodies) noexcept {
  pieces_area_m2_ = overlap_m2_ = 0;
  Vec2 sum = Vec2::Zero();
  for (std::size_t i = 0; i < plan_.pieces.size(); ++i) {
    const SilhouettePlan::Piece& piece = plan_.pieces[i];
    geometry::ConvexPolygon& polygon = pieces_[i];
    polygon.clear();
    for (const Vec2& p : piece.outline) {
      polygon.push_back((bodies[piece.body].X * Vec3(p.x(), p.y(), 0)).head<2>());
    }
    if (geometry::signed_area(polygon) < 0) std::ranges::reverse(polygon);
    const double area = geometry::signed_area(polygon);
    sum += area * geometry::centroid(polygon);
    pieces_area_m2_ += area;
    for (std::size_t j = 0; j < i; ++j) overlap_m2_ += geometry::common_area(polygon, pieces_[j]);
  }
  pieces_centre_ = pieces_area_m2_ > 0 ? Vec2(sum / pieces_area_m2_) : Vec2::Zero();
  best_.fill(Placement{});
  found_ = Placement{};
  placements_ = 0;
}

double SilhouetteFit::covered_m2(const Placement& placement) const noexcept {
  const Eigen::Rotation2Dd turn(placement.angle);
  double covered = -overlap_m2_;
  for (const geometry::Triangle2& triangle : plan_.figure) {
    geometry::Triangle2 placed;
    for (std::size_t i = 0; i < 3; ++i) placed[i] = placement.p + turn * (triangle[i] - plan_.figure_centre);
    for (std::size_t i = 0; i < plan_.pieces.size(); ++i) covered += geometry::common_area(placed, pieces_[i]);
  }
  return covered;
}

bool SilhouetteFit::meets(double covered_m2) const noexcept {
  const double outside_m2 = pieces_area_m2_ - overlap_m2_ - covered_m2;
  return covered_m2 >= plan_.covered * plan_.figure_area_m2 && outside_m2 <= plan_.outside * plan_.figure_area_m2;
}

void SilhouetteFit::try_start() noexcept {
  Placement start{pieces_centre_, 2 * std::numbers::pi * placements_ / kAngles};
  start.covered_m2 = covered_m2(start);
  const auto better = std::ranges::find_if(best_, [&](const Placement& p) { return p.covered_m2 < start.covered_m2; });
  if (better != best_.end()) {
    std::move_backward(better, best_.end() - 1, best_.end());
    *better = start;
  }
  if (++placements_ == kAngles) {
    candidate_ = -1;
    next_candidate();
  }
}

void SilhouetteFit::next_candidate() noexcept {
  if (current_.covered_m2 > found_.covered_m2 && candidate_ >= 0) found_ = current_;
  if (++candidate_ == static_cast<int>(best_.size()) || meets(found_.covered_m2)) return finish();
  current_ = best_[static_cast<std::size_t>(candidate_)];
  step_ = kFirstStep;
  direction_ = 0;
  has_improved_ = false;
}

void SilhouetteFit::try_pattern() noexcept {
  Placement trial = current_;
  const double sign = direction_ % 2 == 0 ? 1 : -1;
  if (direction_ < 2)
    trial.p.x() += sign * step_ * size_m_;
  else if (direction_ < 4)
    trial.p.y() += sign * step_ * size_m_;
  else
    trial.angle += sign * step_;
  trial.covered_m2 = covered_m2(trial);
  if (trial.covered_m2 > current_.covered_m2) {
    current_ = trial;
    has_improved_ = true;
  }
  direction_ = (direction_ + 1) % 6;
  if (++placements_ >= kMaxPlacements) {
    if (current_.covered_m2 > found_.covered_m2) found_ = current_;
    return finish();
  }
  if (direction_ != 0) return;
  if (!std::exchange(has_improved_, false)) step_ /= 2;
  if (step_ < kLastStep || meets(current_.covered_m2)) next_candidate();
}

void SilhouetteFit::finish() noexcept {
  covered_ = found_.covered_m2 / plan_.figure_area_m2;
  outside_ = (pieces_area_m2_ - overlap_m2_ - found_.covered_m2) / plan_.figure_area_m2;
  is_covered_ = meets(found_.covered_m2);
  placements_ = -1;
  waited_ = 0;
}

}  // namespace tandem::server

#include "common/contact/shell/leaf_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/contact/lanes/lanes.hpp"

namespace tandem::contact {
namespace {

static_assert(kShellLeafPoints == kEight);

/// Sums over the points of a leaf. The weights of the points are their areas or their forces.
struct MeanSums {
  double area = 0, distance = 0, weight = 0;
  Vec3 place = Vec3::Zero(), gradient = Vec3::Zero();
};

/// Parameters of next_queries() that are common to all points of a leaf.
struct QueryBounds {
  double moved_m, least_band_m, before_m, farthest_m, error_m;
};

// Points whose distances differ by at most this value may be merged [m]: a few quanta of a distance grid.
constexpr double kAlike_m = 1e-6;
// Pressing points are merged only if the mean of their unit gradients is at least this long, that is, if the gradients
// are nearly parallel.
constexpr double kSameWay = 0.98;
// Conditions for a point in a thin wall:
// * kCreaseSlope: a shorter gradient means that the point is near a crease of the field, in the middle of the wall.
// * kBesideErrors: at this multiple of the field's error on both sides of the wall, the gradient is accurate.
// * kFacingWall: least component of these two gradients along the point's normal, in magnitude.
constexpr double kCreaseSlope = 0.5, kBesideErrors = 4, kFacingWall = 0.6;
// Limits of the correction in a thin wall:
// * kThinHalfErrors: largest half thickness of such a wall, as a multiple of the field's error.
// * kDeepened, kStopped: largest corrected depth, as a multiple of the sampled depth and of the rigid depth.
constexpr double kThinHalfErrors = 1.5, kDeepened = 4, kStopped = 1.2;

}  // namespace
}  // namespace tandem::contact

#define TANDEM_KERNEL "common/contact/lanes/leaf_samples.inc"
#include "common/contact/lanes/twice.inc"

namespace tandem::contact {

void LeafSamples::prefetch(const PointShell& shell, const ShellNode& node) noexcept {
  const std::size_t size = std::min(node.count, kShellLeafPoints);
  if (size < node.count) {
    for (std::size_t k = 0; k < size; ++k) __builtin_prefetch(&shell.points[first_of(node, size, k)]);
    return;
  }
  // The points are contiguous in memory, so one prefetch for each cache line suffices.
  constexpr std::size_t kLineBytes = 64;
  const auto* const begin = reinterpret_cast<const char*>(&shell.points[node.first]);
  for (std::size_t at = 0; at < size * sizeof(ShellPoint); at += kLineBytes) __builtin_prefetch(begin + at);
  __builtin_prefetch(begin + size * sizeof(ShellPoint) - 1);
}

LeafSamples::LeafSamples(const PointShell& shell, const ShellNode& node, const DistanceField& field,
                         const Eigen::Matrix3d& R_FP, const Vec3& p_FP, const LeafLags& lags, double up_to_m,
                         double rigid_depth_m) noexcept
    : shell_(shell), node_(node), field_(field), size_(std::min(node.count, kShellLeafPoints)) {
  prefetch(shell, node);
  std::array<const ShellPoint*, kShellLeafPoints> points;
  std::array<std::uint8_t, kShellLeafPoints> queried;
  const double up_to = up_to_m / kLagStep_m;
  for (std::size_t k = 0; k < size_; ++k) {
    points[queries_] = &shell_.points[first_of(k)];
    queried[queries_] = static_cast<std::uint8_t>(k);
    queries_ += lags[k] <= up_to ? 1 : 0;  // branch-free, because the pattern is unpredictable
  }
  samples_.col(0).setConstant(std::numeric_limits<double>::infinity());
  nearest_m_ = farthest_m_ = std::numeric_limits<double>::infinity();
  if (queries_ == 0) return;
  for (std::size_t i = queries_; i % 4 != 0; ++i) points[i] = points[i - 1];
  EightPlaces places_F;
  EightSamples samples;
  (uses_avx2() ? avx2::place_points : portable::place_points)(points.data(), (queries_ + 3) / 4, R_FP.data(),
                                                              p_FP.data(), places_F.data());
  field.sample_all(places_F, queries_, samples);
  for (std::uint32_t i = 0; i < queries_; ++i) samples_.row(queried[i]) = samples.row(i);
  const auto distances = samples_.col(0).head(static_cast<Eigen::Index>(size_));
  nearest_m_ = distances.minCoeff();
  farthest_m_ = distances.maxCoeff();
  if (node.count > size_) area_scale_ = area_scale();
  if (nearest_m_ < 0 && field.error_m() > 0) sample_from_outside(R_FP, p_FP, rigid_depth_m);
}

// Corrects the depths of points in a wall that is hardly thicker than a cell of the grid. In the middle of such a wall,
// the interpolated depth is too small, and the gradient may point to the wrong face. The right face is the one whose
// outward normal is opposite to the point's normal. The depth below this face is extrapolated from a sample outside of
// it, and limited to the depth at which contact stops the point.
void LeafSamples::sample_from_outside(const Eigen::Matrix3d& R_FP, const Vec3& p_FP, double rigid_depth_m) noexcept {
  const double way_m = kBesideErrors * field_.error_m();
  for (std::size_t k = 0; k < size_; ++k) {
    auto sample = samples_.row(static_cast<Eigen::Index>(k));
    const double depth_m = -sample[0];
    if (!(depth_m > 0)) continue;
    const ShellPoint& point = shell_.points[first_of(k)];
    const Vec3 normal_F = R_FP * point.normal_S.cast<double>();
    const Vec3 slope_F = sample.tail<3>().matrix().transpose();
    if (slope_F.squaredNorm() > kCreaseSlope * kCreaseSlope && slope_F.dot(normal_F) < 0) continue;
    const Vec3 p_F = R_FP * point.p_S.cast<double>() + p_FP;
    const DistanceSample beyond = field_.sample(p_F + way_m * normal_F);
    if (beyond.distance_m <= 0 || beyond.gradient.normalized().dot(normal_F) < kFacingWall) continue;
    const DistanceSample before = field_.sample(p_F - way_m * normal_F);
    const Vec3 out_F = before.gradient.normalized();
    if (before.distance_m <= 0 || !(out_F.dot(normal_F) < -kFacingWall)) continue;
    const double from_outside_m = -before.distance_m - way_m * out_F.dot(normal_F);
    const double half_m = way_m - (before.distance_m + beyond.distance_m) / 2;
    if (half_m > kThinHalfErrors * field_.error_m()) continue;
    const double most_m = std::max(depth_m, std::min(kDeepened * depth_m, kStopped * rigid_depth_m));
    sample[0] = -std::clamp(from_outside_m, depth_m, most_m);
    sample.tail<3>() = out_F.transpose().array();
    is_held_ = true;
  }
}

// Returns the ratio of the node's area to the sum of the sampled points' areas.
double LeafSamples::area_scale() const {
  double area = 0;
  for (std::size_t k = 0; k < size_; ++k) area += shell_.points[first_of(k)].area_m2;
  return area > 0 ? node_.mean.area_m2 / area : 1;
}

double LeafSamples::query_again_at_m(double moved_m, double least_band_m, double before_m, LeafLags& lags) const {
  const QueryBounds known{.moved_m = moved_m - kRounding_m,
                          .least_band_m = least_band_m,
                          .before_m = before_m,
                          .farthest_m = field_.band_m(),
                          .error_m = 2 * field_.error_m()};
  return (uses_avx2() ? avx2::next_queries : portable::next_queries)(known, samples_.data(), size_, lags.data());
}

std::size_t LeafSamples::near_count(double band_m) const {
  if (nearest_m_ >= band_m) return 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < size_; ++k) count += distance_m(k) < band_m ? 1 : 0;
  return count * node_.count / size_;
}

ShellCandidate LeafSamples::candidate_of(std::size_t k) const {
  const ShellPoint& point = shell_.points[first_of(k)];
  return {.p_P = point.p_S,
          .area_m2 = static_cast<float>(area_scale_ * point.area_m2),
          .distance_m = distance_m(k),
          .gradient_F = samples_.row(static_cast<Eigen::Index>(k)).tail<3>().matrix().transpose(),
          .first = first_of(k),
          .count = first_of(k + 1) - first_of(k)};
}

ShellCandidate LeafSamples::mean_of(double low_m, double high_m) const {
  std::array<const ShellPoint*, kShellLeafPoints> points;
  for (std::size_t k = 0; k < kShellLeafPoints; ++k) points[k] = &shell_.points[first_of(std::min(k, size_ - 1))];
  MeanSums sums;
  (uses_avx2() ? avx2::sum_means : portable::sum_means)(points.data(), samples_.data(), low_m, high_m, area_scale_,
                                                        sums);
  if (!(sums.weight > 0)) return {};
  return {.p_P = (sums.place / sums.weight).cast<float>(),
          .area_m2 = static_cast<float>(sums.area),
          .distance_m = sums.distance / sums.area,
          .gradient_F = sums.gradient / sums.weight,
          .first = node_.first,
          .count = node_.count};
}

void LeafSamples::add_points(double band_m, std::vector<ShellCandidate>& candidates) const {
  if (nearest_m_ >= band_m) return;
  if (size_ > 1 && !is_held_ && farthest_m_ - nearest_m_ <= kAlike_m && farthest_m_ < band_m) {
    const ShellCandidate mean = mean_of(nearest_m_, band_m);
    // At a round obstacle, points of equal depth have different gradients. Such points are not merged.
    if (mean.area_m2 > 0 && mean.gradient_F.norm() > 1 - kAlike_m) return candidates.push_back(mean);
  }
  for (std::size_t k = 0; k < size_; ++k) {
    if (distance_m(k) < band_m) candidates.push_back(candidate_of(k));
  }
}

void LeafSamples::add_joined(double band_m, double rigid_depth_m, bool must,
                             std::vector<ShellCandidate>& candidates) const {
  if (nearest_m_ >= band_m) return;
  ShellCandidate press, gap;
  if (nearest_m_ < 0) press = mean_of(-std::numeric_limits<double>::infinity(), 0);
  if (farthest_m_ >= 0) gap = mean_of(0, band_m);
  const bool presses = press.area_m2 > 0, has_gap = gap.area_m2 > 0;
  const double coherence = press.gradient_F.norm();
  if (presses && !must) {
    std::size_t rigid = 0, pressing = 0;
    for (std::size_t k = 0; k < size_; ++k) {
      rigid += distance_m(k) <= -rigid_depth_m ? 1 : 0;
      pressing += distance_m(k) < 0 ? 1 : 0;
    }
    if (coherence < kSameWay || is_held_ || (rigid > 0 && rigid < pressing)) {
      for (std::size_t k = 0; k < size_; ++k) {
        if (distance_m(k) < band_m) candidates.push_back(candidate_of(k));
      }
      return;
    }
  }
  // If the leaf gives both a pressing candidate and one with a gap, the latter gets the id of the last point. The ids
  // then differ.
  if (presses) {
    press.distance_m *= coherence;
    if (press.gradient_F.isZero()) press.gradient_F = Vec3::UnitZ();
    press.count -= has_gap ? 1 : 0;
    candidates.push_back(press);
  }
  if (has_gap) {
    if (presses) {
      gap.first += gap.count - 1;
      gap.count = 1;
    }
    if (gap.gradient_F.isZero()) gap.gradient_F = Vec3::UnitZ();
    candidates.push_back(gap);
  }
}

}  // namespace tandem::contact

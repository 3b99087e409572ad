#include "common/contact/shell/leaf_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::contact {
namespace {

// Points whose distances differ by less than this act as one: a few quanta of a distance grid.
constexpr double kAlike_m = 1e-6;
// Of unit vectors that act as one: what is left of their sum.
constexpr double kSameWay = 0.98;

}  // namespace

LeafSamples::LeafSamples(const PointShell& shell, const ShellNode& node, const DistanceField& field,
                         const Eigen::Matrix3d& R_FP, const Vec3& p_FP, const LeafLags& lags, double up_to_m) noexcept
    : shell_(shell),
      node_(node),
      size_(std::min(node.count, kShellLeafPoints)),
      nearest_m_(std::numeric_limits<double>::infinity()) {
  prefetch(shell, node);
  std::array<Vec3, kShellLeafPoints> places_F;
  std::array<std::size_t, kShellLeafPoints> asked;
  double area = 0;
  for (std::size_t k = 0; k < size_; ++k) {
    const ShellPoint& point = shell_.points[first_of(k)];
    area += point.area_m2;
    samples_[k].distance_m = std::numeric_limits<double>::infinity();
    if (lags[k] * kLagStep_m > up_to_m) continue;
    places_F[asked_] = R_FP * point.p_S.cast<double>() + p_FP;
    asked[asked_++] = k;
  }
  std::array<DistanceSample, kShellLeafPoints> samples;
  field.sample_all({places_F.data(), asked_}, {samples.data(), asked_});
  for (std::size_t i = 0; i < asked_; ++i) {
    samples_[asked[i]] = samples[i];
    nearest_m_ = std::min(nearest_m_, samples[i].distance_m);
  }
  farthest_m_ = nearest_m_;
  for (std::size_t k = 0; k < size_; ++k) farthest_m_ = std::max(farthest_m_, samples_[k].distance_m);
  if (node.count > size_ && area > 0) area_scale_ = node.mean.area_m2 / area;
}

std::size_t LeafSamples::near_count(double band_m) const {
  if (nearest_m_ >= band_m) return 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < size_; ++k) count += samples_[k].distance_m < band_m ? 1 : 0;
  return count * node_.count / size_;
}

ShellCandidate LeafSamples::candidate_of(std::size_t k) const {
  const ShellPoint& point = shell_.points[first_of(k)];
  return {.p_P = point.p_S,
          .area_m2 = static_cast<float>(area_scale_ * point.area_m2),
          .distance_m = samples_[k].distance_m,
          .gradient_F = samples_[k].gradient,
          .first = first_of(k),
          .count = first_of(k + 1) - first_of(k)};
}

ShellCandidate LeafSamples::mean_of(double low_m, double high_m) const {
  double area_m2 = 0, distance = 0, weights = 0;
  Vec3 p_P = Vec3::Zero(), gradient_F = Vec3::Zero();
  for (std::size_t k = 0; k < size_; ++k) {
    const double distance_m = samples_[k].distance_m;
    if (!(distance_m >= low_m && distance_m < high_m)) continue;
    const ShellPoint& point = shell_.points[first_of(k)];
    const double area = area_scale_ * point.area_m2;
    const double weight = high_m <= 0 ? -area * distance_m : area;
    area_m2 += area;
    distance += area * distance_m;
    weights += weight;
    p_P += weight * point.p_S.cast<double>();
    gradient_F += weight * samples_[k].gradient.normalized();
  }
  if (!(weights > 0)) return {};
  return {.p_P = (p_P / weights).cast<float>(),
          .area_m2 = static_cast<float>(area_m2),
          .distance_m = distance / area_m2,
          .gradient_F = gradient_F / weights,
          .first = node_.first,
          .count = node_.count};
}

void LeafSamples::add_points(double band_m, std::vector<ShellCandidate>& candidates) const {
  if (nearest_m_ >= band_m) return;
  if (size_ > 1 && farthest_m_ - nearest_m_ <= kAlike_m && farthest_m_ < band_m) {
    const ShellCandidate mean = mean_of(nearest_m_, band_m);
    // What lies around something round is not flat.
    if (mean.area_m2 > 0 && mean.gradient_F.norm() > 1 - kAlike_m) return candidates.push_back(mean);
  }
  for (std::size_t k = 0; k < size_; ++k) {
    if (samples_[k].distance_m < band_m) candidates.push_back(candidate_of(k));
  }
}

void LeafSamples::add_joined(double band_m, double rigid_depth_m, bool must,
                             std::vector<ShellCandidate>& candidates) const {
  if (nearest_m_ >= band_m) return;
  ShellCandidate press = mean_of(-std::numeric_limits<double>::infinity(), 0);
  ShellCandidate gap = mean_of(0, band_m);
  const bool presses = press.area_m2 > 0, has_gap = gap.area_m2 > 0;
  const double coherence = press.gradient_F.norm();
  if (presses && !must) {
    std::size_t rigid = 0, pressing = 0;
    for (std::size_t k = 0; k < size_; ++k) {
      rigid += samples_[k].distance_m <= -rigid_depth_m ? 1 : 0;
      pressing += samples_[k].distance_m < 0 ? 1 : 0;
    }
    if (coherence < kSameWay || (rigid > 0 && rigid < pressing)) {
      for (std::size_t k = 0; k < size_; ++k) {
        if (samples_[k].distance_m < band_m) candidates.push_back(candidate_of(k));
      }
      return;
    }
  }
  // Of both, the last point has the name of those that do not press.
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

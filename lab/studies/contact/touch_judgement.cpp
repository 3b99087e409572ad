#include "lab/studies/contact/touch_judgement.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

namespace tandem::lab {
namespace {

constexpr std::size_t kExactEvery = 50;
constexpr std::size_t kCopyBytes = 256U << 10U;
constexpr int kCopies = 5000;
constexpr int kSampleRounds = 50;
constexpr std::size_t kSamplePoints = 4096;
constexpr std::size_t kPointsOfBody = 200;  // number of points that are tracked on each body
constexpr double kTooDeep_m = 2e-3;
constexpr double kShallow_m = 5e-4;
constexpr double kPiece_m = 2.5e-4;
constexpr int kMaxPieces = 1000;

double deepest_exact_m(const TouchTrace& trace, const ExactSurface& tool, const ExactSurface& fixed) {
  double deepest_m = 0;
  for (std::size_t i = 0; i < trace.size(); i += kExactEvery) {
    const Pose& X_WT = trace[i].X_WT;
    // To save time, the search ignores overlaps that are not deeper than the deepest one of the earlier steps.
    deepest_m = std::max(deepest_m, deepest_overlap_m(tool, X_WT, fixed, Pose{}, deepest_m));
  }
  return deepest_m;
}

/// Tracks points on the surface of one body in their motion relative to another body.
class PointsThrough {
 public:
  /// Begins to track the points.
  /// In      points_M  points in the frame of the moving body
  ///         half_m    distance of the body's surface from these points: half the thickness of a plate, 0 for a solid
  PointsThrough(const std::vector<Vec3>& points_M, double half_m, const ExactSurface& other)
      : other_(other), reach_m_(half_m + other.half_thickness_m()) {
    for (const Vec3& p_M : points_M) followers_.push_back({.p_M = p_M});
  }

  /// Moves the points to a new relative pose. Returns the number of points that were popped through the other body at
  /// any time in this step. A point that left the other body within the step also counts.
  std::size_t step(const Pose& X_OM);
  double deepest_m() const { return deepest_m_; }

 private:
  struct Follower {
    Vec3 p_M = Vec3::Zero();
    Vec3 last_O = Vec3::Zero();
    Vec3 entry_O = Vec3::Zero();  ///< normal of the nearest surface when the point was last outside
    bool is_inside = false;
    bool is_through = false;
    bool was_through = false;  ///< whether the point was popped through at any time in this step
  };
  void move(Follower& follower, const Vec3& p_O);

  const ExactSurface& other_;
  double reach_m_;  ///< distance between a tracked point and the other mesh at which the two surfaces touch
  std::vector<Follower> followers_;
  double deepest_m_ = 0;
  bool has_started_ = false;
};

std::size_t PointsThrough::step(const Pose& X_OM) {
  std::size_t through = 0;
  for (Follower& follower : followers_) {
    const Vec3 p_O = X_OM * follower.p_M;
    follower.was_through = false;
    if (!has_started_) follower.last_O = p_O;
    const Vec3 from_O = follower.last_O;
    const double length = (p_O - from_O).norm();
    const int pieces = std::clamp(static_cast<int>(std::ceil(length / kPiece_m)), 1, kMaxPieces);
    // A ball encloses the point's straight path in this step. If the ball does not reach the bounding box of the other
    // body, contact is impossible and the path need not be tested.
    if (follower.is_inside || other_.may_touch((from_O + p_O) / 2, length / 2 + kTooDeep_m + reach_m_)) {
      for (int i = 1; i <= pieces; ++i) move(follower, from_O + (p_O - from_O) * i / pieces);
    }
    follower.last_O = p_O;
    through += follower.is_through || follower.was_through ? 1 : 0;
  }
  has_started_ = true;
  return through;
}

void PointsThrough::move(Follower& follower, const Vec3& p_O) {
  const geometry::TriangleTree::Closest closest = other_.closest(p_O, kTooDeep_m + reach_m_);
  if (closest.triangle < 0) {
    // No surface is within the search distance. A point that was inside a solid is now deeper than this distance. A
    // point that was inside a plate has left the plate.
    const bool is_solid = other_.half_thickness_m() <= 0;
    if (follower.is_inside && is_solid) {
      follower.is_through = true;
      deepest_m_ = std::max(deepest_m_, -other_.distance_m(p_O, std::numeric_limits<double>::infinity()));
    }
    follower.is_inside = follower.is_inside && is_solid;
    follower.is_through = follower.is_through && is_solid;
    return;
  }
  const double depth_m = reach_m_ - closest.distance_m;
  follower.is_inside = depth_m > 0;
  if (!follower.is_inside) {
    follower.entry_O = closest.normal_S;
    follower.is_through = false;
    return;
  }
  deepest_m_ = std::max(deepest_m_, depth_m);
  if (depth_m > kShallow_m && closest.normal_S.dot(follower.entry_O) < 0) {
    follower.is_through = follower.was_through = true;
  }
}

/// Counts pop-throughs: events in which one body passes through the surface of the other. Points on the surface of each
/// body are tracked. An event begins when the number of points that have popped through becomes positive. The count
/// depends only on the motion and on the exact meshes.
///
/// Model   A point has popped through in two cases:
///         * It is more than kTooDeep_m inside a solid.
///         * It is more than kShallow_m inside, and the nearest surface is the opposite one of a thin wall: its normal
///           points away from the surface through which the point entered.
///
///         Between two steps the points move along straight lines, which are tested in pieces of at most kPiece_m.
class PopThroughWatch {
 public:
  /// Samples the points of both bodies.
  /// In      a, b  must be separate at the first step
  PopThroughWatch(const ExactSurface& a, const ExactSurface& b) {
    for (const ExactSurface* of_a : a.parts()) {
      for (const ExactSurface* of_b : b.parts()) {
        a_in_b_.emplace_back(of_a->samples(kPointsOfBody, 1), of_a->half_thickness_m(), *of_b);
        b_in_a_.emplace_back(of_b->samples(kPointsOfBody, 2), of_b->half_thickness_m(), *of_a);
      }
    }
  }

  void step(const Pose& X_WA, const Pose& X_WB) {
    std::size_t through = 0;
    for (PointsThrough& points : a_in_b_) through += points.step(X_WB.inverse() * X_WA);
    for (PointsThrough& points : b_in_a_) through += points.step(X_WA.inverse() * X_WB);
    if (through > 0 && !is_through_) ++count_;
    is_through_ = through > 0;
  }
  std::uint64_t count() const { return count_; }
  /// Returns the largest depth of any point at any step.
  double deepest_m() const {
    double deepest_m = 0;
    for (const auto* side : {&a_in_b_, &b_in_a_}) {
      for (const PointsThrough& points : *side) deepest_m = std::max(deepest_m, points.deepest_m());
    }
    return deepest_m;
  }

 private:
  std::vector<PointsThrough> a_in_b_;  ///< one entry for each pair of a part of A and a part of B
  std::vector<PointsThrough> b_in_a_;
  std::uint64_t count_ = 0;
  bool is_through_ = false;
};

std::size_t separations_of(const TouchTrace& trace) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < trace.size(); ++i) count += trace[i - 1].contacts > 0 && trace[i].contacts == 0 ? 1 : 0;
  return count;
}

void judge_energy(const TouchTrace& trace, TouchFigures& figures) {
  double work_j = 0, least_work_j = 0;
  // smallest sum so far of the work before a step and the energy stored at its start
  double least_j = std::numeric_limits<double>::infinity();
  for (const TouchStep& step : trace) {
    least_j = std::min(least_j, work_j + step.contact_stored_j);
    work_j += step.contact_work_j;
    figures.contact_created_j = std::max(figures.contact_created_j, work_j - least_j);
    figures.contact_returned_j = std::max(figures.contact_returned_j, work_j - least_work_j);
    least_work_j = std::min(least_work_j, work_j);
  }
}

}  // namespace

TouchFigures quick_figures_of(const std::vector<TouchTrace>& runs) {
  TouchFigures figures;
  const TouchTrace trace = fastest_of(runs);
  figures.steps = trace.size();
  std::vector<Duration> queries, steps;
  std::vector<std::uint32_t> query_counts;
  for (const TouchStep& step : trace) {
    queries.push_back(step.query);
    steps.push_back(step.step);
    query_counts.push_back(step.queries);
    figures.contacts_max = std::max(figures.contacts_max, step.contacts);
    figures.force_jump_max_n = std::max(figures.force_jump_max_n, step.force_jump_n);
    figures.not_converged += step.has_converged ? 0 : 1;
  }
  for (std::size_t i = 1; i < trace.size(); ++i) {
    const Wrench &last = trace[i - 1].on_hand_W, &now = trace[i].on_hand_W;
    figures.hand_force_step_max_n = std::max(figures.hand_force_step_max_n, (now.f - last.f).norm());
    figures.hand_torque_step_max_n_m = std::max(figures.hand_torque_step_max_n_m, (now.t - last.t).norm());
  }
  figures.separations = separations_of(trace);
  judge_energy(trace, figures);
  figures.queries_p50 = quantile_of(query_counts, 0.5);
  figures.queries_p99 = quantile_of(std::move(query_counts), 0.99);
  figures.query_us = quantiles_of(std::move(queries));
  figures.step_us = quantiles_of(std::move(steps));
  steps.clear();
  for (const TouchStep& step : runs.front()) steps.push_back(step.step);
  figures.step_once_us = quantiles_of(std::move(steps));
  return figures;
}

TouchFigures figures_of(const std::vector<TouchTrace>& runs, const ExactSurface& tool, const ExactSurface& fixed) {
  TouchFigures figures = quick_figures_of(runs);
  const TouchTrace& trace = runs.front();
  PopThroughWatch watch(tool, fixed);
  for (const TouchStep& step : trace) watch.step(step.X_WT, Pose{});
  figures.pop_throughs = watch.count();
  figures.max_penetration_m = std::max(deepest_exact_m(trace, tool, fixed), watch.deepest_m());
  return figures;
}

double field_sample_ns(const contact::ContactShape& shape, const Clock& clock) {
  const auto& points = shape.shells.surface.points;
  const std::size_t count = std::min(points.size(), kSamplePoints);
  double sum = 0;
  const LocalTime begin = clock.now();
  for (int round = 0; round < kSampleRounds; ++round) {
    for (std::size_t i = 0; i < count; ++i) sum += shape.field->sample(points[i].p_S.cast<double>()).distance_m;
  }
  const Duration took = clock.now() - begin;
  if (!std::isfinite(sum)) throw std::runtime_error("the distance field gave a value that is not finite");
  return to_seconds(took) * 1e9 / (static_cast<double>(count) * kSampleRounds);
}

TimeQuantiles memory_copy_us(const Clock& clock) {
  std::vector<char> from(kCopyBytes, 1), to(kCopyBytes);
  std::vector<Duration> times;
  for (int i = 0; i < kCopies; ++i) {
    from[static_cast<std::size_t>(i) % kCopyBytes] = static_cast<char>(i);
    const LocalTime copy_begin = clock.now();
    std::memcpy(to.data(), from.data(), kCopyBytes);
    times.push_back(clock.now() - copy_begin);
  }
  return quantiles_of(std::move(times));
}

}  // namespace tandem::lab

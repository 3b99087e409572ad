#include "lab/studies/contact/touch_judgement.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "lab/studies/contact/pop_through.hpp"

namespace tandem::lab {
namespace {

constexpr std::size_t kExactEvery = 50;
constexpr std::size_t kCopyBytes = 256U << 10U;
constexpr int kCopies = 5000;
constexpr int kSampleRounds = 50;
constexpr std::size_t kSamplePoints = 4096;

double deepest_exact_m(const TouchTrace& trace, const ExactSurface& tool, const ExactSurface& fixed) {
  double deepest_m = 0;
  for (std::size_t i = 0; i < trace.size(); i += kExactEvery) {
    const Pose& X_WT = trace[i].X_WT;
    // Only what is deeper than the deepest so far is looked for.
    deepest_m = std::max(deepest_m, deepest_overlap_m(tool, X_WT, fixed, Pose{}, deepest_m));
  }
  return deepest_m;
}

}  // namespace

TouchFigures quick_figures_of(const std::vector<TouchTrace>& runs) {
  TouchFigures figures;
  const TouchTrace trace = fastest_of(runs);
  figures.steps = trace.size();
  std::vector<Duration> queries, steps;
  for (const TouchStep& step : trace) {
    queries.push_back(step.query);
    steps.push_back(step.step);
    figures.contacts_max = std::max(figures.contacts_max, step.contacts);
    figures.force_jump_max_n = std::max(figures.force_jump_max_n, step.force_jump_n);
    figures.not_converged += step.has_converged ? 0 : 1;
  }
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

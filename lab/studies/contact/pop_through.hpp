// Whether something passed through a surface, judged from the motion and the exact meshes alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

/// Follows points of the surface of each of two bodies against the other, and counts how often the pair goes from none
/// through to some.
///
/// Model   A point has popped through when it is more than `too_deep_m` inside, or more than `shallow_m` inside and
///         closest to a side that faces away from the one it came in by: so thin walls count too. Between steps the
///         points are taken to move straight, in pieces of at most 0.25 mm.
class PopThroughWatch {
 public:
  static constexpr std::size_t kPoints = 200;  ///< of each body
  /// In      a, b  apart at the first step
  PopThroughWatch(const ExactSurface& a, const ExactSurface& b, double too_deep_m = 2e-3, double shallow_m = 5e-4);
  ~PopThroughWatch();

  void step(const Pose& X_WA, const Pose& X_WB);
  std::uint64_t count() const;
  /// Of any point at any step.
  double deepest_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::lab

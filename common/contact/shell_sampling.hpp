// The points of a surface before they become a shell: spread so that they cover it, each with its share.
#pragma once

#include <functional>
#include <vector>

#include "common/contact/point_shell.hpp"
#include "common/geometry/sample_grid.hpp"
#include "common/geometry/surface_features.hpp"

namespace tandem::contact {

struct SpreadSamples {
  std::vector<geometry::SurfaceSample> samples;
  std::vector<float> areas_m2;   ///< of each; they sum to the surface
  std::vector<bool> is_feature;  ///< of each
  double spacing_m = 0;          ///< what it came to
};

/// Covers `surface`: each of its points is within `spacing_m` of a sample that faces the same way.
///
/// Model   sharp edges first; then darts into pieces of the triangles, each kept when nothing is nearer than 0.9
///         spacings, each piece halved until the ball around one sample holds all of it: that proves coverage exactly,
///         for balls are convex. Last, what stands out between the samples.
/// Source  after White, Cline & Egbert, "Poisson disk point sets by hierarchical dart throwing", 2007; the stop by
///         covering balls and its use on surfaces are ours
SpreadSamples spread_samples(const geometry::SurfaceTopology& surface, const ContactShapeOptions& options,
                             const std::function<void(double)>& progress);

}  // namespace tandem::contact

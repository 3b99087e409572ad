// Spreads samples over a surface and divides the surface's area among them. The samples become the points of a shell.
#pragma once

#include <functional>
#include <vector>

#include "common/contact/points/point_shell.hpp"
#include "common/geometry/sample_grid.hpp"
#include "common/geometry/surface_features.hpp"

namespace tandem::contact {

struct SpreadSamples {
  std::vector<geometry::SurfaceSample> samples;
  std::vector<float> areas_m2;   ///< area of each sample; the areas sum to the area of the surface
  std::vector<bool> is_feature;  ///< whether the sample lies on an edge, a corner or a bump
  double spacing_m = 0;          ///< maximum distance from any point of the surface to the nearest sample
};

/// Spreads samples over `surface`. Each point of the surface is within `spacing_m` of a sample with a similar normal.
///
/// Model   1. Sharp edges and corners are sampled.
///         2. Random points (darts) are drawn in pieces of the triangles. A dart becomes a sample if no other sample is
///            nearer than 0.9 spacings. Each piece is halved until all its corners are in the ball of one spacing
///            around some sample. As balls are convex, the whole piece is then in this ball, which proves the coverage.
///         3. Features that protrude between the samples are added.
/// Source  after White, Cline & Egbert, "Poisson disk point sets by hierarchical dart throwing", 2007; the stopping
///         criterion by covering balls and the application of the method to surfaces are ours
SpreadSamples spread_samples(const geometry::SurfaceTopology& surface, const ContactShapeOptions& options,
                             const std::function<void(double)>& progress);

}  // namespace tandem::contact

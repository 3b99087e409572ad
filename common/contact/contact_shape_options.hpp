// Options for the resolution of a contact shape.
#pragma once

#include <cstddef>

namespace tandem::contact {

/// Smallest edge of a cell of a distance grid.
inline constexpr double kMinCell_m = 1e-5;

/// Resolution of the distances and points of a contact shape.
struct ContactShapeOptions {
  // Resolution of the sampled distances to a mesh.
  double cell_m = 8e-4;       ///< largest cell edge near the surface; cells are halved up to twice where needed
  double tolerance_m = 3e-5;  ///< cells are halved where the interpolation error near the surface exceeds this value
  double band_m = 2.5e-3;     ///< distances up to this value, inside and outside, are sampled at full resolution
  /// Limit of the grid's memory. A grid that would exceed it gets wider cells; its error grows in proportion to their
  /// size.
  std::size_t max_grid_bytes = std::size_t{48} << 20U;
  int threads = 2;  ///< threads that build the grid

  // Resolution of the surface points.
  double spacing_m = 4.5e-4;  ///< maximum distance from any point of the surface to the nearest sample
  /// Sharp edges and their corners are sampled exactly, at `feature_spacing_m`. Without these samples, a sharp edge
  /// could slip between the points of the other shape. An edge is sharp if the normals of its faces differ by more than
  /// this angle.
  double feature_angle_deg = 25;
  double feature_spacing_m = 2.5e-4;
  /// A vertex that protrudes from the sampled surface by more than this height becomes a point of its own.
  double feature_height_m = 5e-5;
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
  /// Maximum number of evenly spaced points. If more are needed, the spacing is widened. Bumps may add 25 %.
  std::size_t max_points = 400'000;
#else
  std::size_t max_points = 1'000;  ///< small limit for fuzzing, where thousands of scenes are built
#endif

  /// True: if the shape contains rods thinner than 0.8 mm, its whole surface gets points and cells that suit the radius
  /// of these rods.
  bool refines_rods = true;

  /// An open sheet is treated as a plate of this thickness, whose middle surface is the sheet.
  double sheet_thickness_m = 1e-3;
};

/// Fails   std::invalid_argument: an option that affects a mesh's shape is out of its range
void check(const ContactShapeOptions& options);

}  // namespace tandem::contact

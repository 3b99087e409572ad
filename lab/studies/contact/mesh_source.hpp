// Loads or generates the mesh of a benchmark.
#pragma once

#include <optional>
#include <string>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// Returns the mesh with the centre of its bounding box at the origin.
///
/// In      name    "peg", "box_with_hole", "sphere", "cube", or the path of a file
///         option  command-line option for error messages, e.g. "--a"
///         largest_size_m  desired longest edge of the bounding box; used for files if `factor` is not given
///         factor  metres per unit of the file; generated meshes are already in metres
/// Fails   std::invalid_argument: "--a is /x/y.obj, which does not exist; …"
geometry::TriangleMesh mesh_from(const std::string& name, const std::string& option, double largest_size_m = 0.1,
                                 std::optional<double> factor = {});

}  // namespace tandem::lab

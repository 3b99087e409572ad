// Source of a benchmark's meshes: a file, or the name of a generated mesh.
#pragma once

#include <optional>
#include <string>

#include "common/geometry/triangle_mesh.hpp"

namespace tandem::lab {

/// The mesh, centred on the middle of its bounding box.
///
/// In      name    "peg", "box_with_hole", "sphere", "cube", or a file
///         option  name of the option, for messages: "--a"
///         largest_size_m  longest edge of the bounding box, for files without `factor`
///         factor  metres per unit of the file; generated meshes are in metres already
/// Fails   std::invalid_argument: "--a is /x/y.obj, which does not exist; …"
geometry::TriangleMesh mesh_from(const std::string& name, const std::string& option, double largest_size_m = 0.1,
                                 std::optional<double> factor = {});

}  // namespace tandem::lab

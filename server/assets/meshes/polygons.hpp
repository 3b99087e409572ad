// Faces of a mesh file as its format stores them, before they are cut into triangles. Every reader of a format makes this.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::server::mesh_reader {

/// A file that is refused; the text follows the file's name: "which …; remedy".
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Vertices in the file's units and z up; face f has face_sizes[f] consecutive entries of `corners`.
struct Polygons {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> corners;
  std::vector<std::uint32_t> face_sizes;
  /// Distance between neighbouring numbers at 1 in the type that the file stores coordinates in.
  double number_step = std::numeric_limits<double>::epsilon();
  /// Uncertainty of coordinates that does not follow from `number_step` [units].
  double step = 0;

  void add_face(const std::vector<std::uint32_t>& face) {
    if (face.size() < 3) return;  // a point or a line
    corners.insert(corners.end(), face.begin(), face.end());
    face_sizes.push_back(static_cast<std::uint32_t>(face.size()));
  }
};

/// Rounding steps of coordinates, as a share of the mesh's longest edge: beyond it the file is refused. The volume of a
/// compact part is then right within 1e-4.
inline constexpr double kMaxStepShare = 1.0 / 32768;

/// Longest edge of the box around the vertices that faces use, its middle, and the largest coordinate.
struct Extent {
  double size = 0;
  Vec3 middle = Vec3::Zero();
  double farthest = 0;
};
Extent extent_of(const Polygons& mesh);

/// Fails   Refusal: an index beyond the last vertex; a coordinate that is not finite; coordinates so far from the origin
///         that their rounding changes the shape
void check(const Polygons& mesh);

}  // namespace tandem::server::mesh_reader

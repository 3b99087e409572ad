// Faces of a mesh file before triangulation. Every format reader produces this type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::server::mesh_reader {

/// Refusal of a mesh file. The text is a relative clause that follows the file's name in the message: "which …;
/// remedy".
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Vertices in the file's units, with z up, and faces. `corners` holds the corners of all faces one after the other;
/// face f has face_sizes[f] of them.
struct Polygons {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> corners;
  std::vector<std::uint32_t> face_sizes;
  /// Relative rounding step of coordinates: the distance from 1 to the next number of the file's number type.
  double number_step = std::numeric_limits<double>::epsilon();
  /// Uncertainty of coordinates from other causes than `number_step`, in the file's units.
  double step = 0;

  void add_face(const std::vector<std::uint32_t>& face) {
    if (face.size() < 3) return;  // points and lines are not faces
    corners.insert(corners.end(), face.begin(), face.end());
    face_sizes.push_back(static_cast<std::uint32_t>(face.size()));
  }
};

/// Largest accepted rounding step of coordinates, as a fraction of the longest edge of the bounding box. A file with a
/// larger step is refused. At this limit the volume of a compact part is accurate to 1e-4.
inline constexpr double kMaxStepShare = 1.0 / 32768;

/// Longest edge and centre of the bounding box of the vertices that faces use, and the largest absolute coordinate.
struct Extent {
  double size = 0;
  Vec3 middle = Vec3::Zero();
  double farthest = 0;
};
Extent extent_of(const Polygons& mesh);

/// Checks the indices and coordinates of a mesh.
/// Fails   Refusal: a face uses an index beyond the last vertex; a coordinate is not finite; or coordinates are so far
///         from the origin that their rounding changes the shape
void check(const Polygons& mesh);

}  // namespace tandem::server::mesh_reader

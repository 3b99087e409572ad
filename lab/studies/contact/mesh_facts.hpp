// Properties of a mesh file before it is used for contact: solids and sheets, wall thickness, size, and a picture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/geometry/mesh_repair.hpp"

namespace tandem::lab {

struct MeshFacts {
  geometry::ContactMesh mesh;
  Vec3 size_units = Vec3::Zero();  ///< size in units of the file
  /// metres per unit of the file. If the file states its unit, its coordinates are converted to metres before, and this
  /// is an additional factor
  double scale_m = 1;
  Vec3 size_m = Vec3::Zero();
  double volume_m3 = 0;        ///< sum of the volumes of all solids; a region in which two solids overlap counts twice
  double overlap_share = 0;    ///< fraction of the solids' surface that overlaps (wall_thickness.hpp)
  bool is_watertight = false;  ///< whether there is no sheet and no hole had to be closed
  /// thinnest wall of the solids (wall_thickness.hpp); 0: there is no solid, or no faces lie opposite each other
  double thinnest_wall_m = 0;
  double resolution_m = 0;  ///< cell size near the surface in the contact grid
  /// reason why the size is implausible, and the options that change it; empty: the size is plausible
  std::string doubt;
};

/// Conversion of a file's units to metres.
struct MeshScale {
  double scale = 1;           ///< metres per unit of the file
  double largest_size_m = 0;  ///< if positive: desired longest edge of the bounding box, and `scale` is ignored
  bool y_is_up = false;       ///< whether y is up in files that do not state their up axis
};

/// Returns the properties of a mesh file.
/// In      warn  function that is called with the reason and the remedy if the size is implausible, before the contact
///         shape is built
/// Fails   std::runtime_error that names the file and the reason why it cannot be used
MeshFacts mesh_facts(const std::filesystem::path& file, const MeshScale& scale,
                     const std::function<void(const std::string& warning)>& warn);

/// Returns an orthographic picture, viewed obliquely from above. Nearer surfaces are lighter; sheets are blue.
///
/// Out     rgb: square picture with `pixels` × `pixels` pixels of three bytes, row by row from top to bottom
std::vector<std::uint8_t> picture_of(const geometry::ContactMesh& mesh, int pixels);

}  // namespace tandem::lab

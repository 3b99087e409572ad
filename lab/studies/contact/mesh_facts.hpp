// Facts about a mesh file before it is used for contact: solids and sheets, wall thickness, size, a picture.
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
  double scale_m = 1;              ///< metres per unit of the file, or per metre where the file states its unit
  Vec3 size_m = Vec3::Zero();
  double volume_m3 = 0;        ///< sum over its solids; overlapping volume counts twice
  double overlap_share = 0;    ///< overlapping share of the surface of its solids (wall_thickness.hpp)
  bool is_watertight = false;  ///< no sheet, and no hole had to be closed
  double thinnest_wall_m = 0;  ///< thinnest wall of its solids (wall_thickness.hpp); 0: no solid, or no opposite faces
  double resolution_m = 0;     ///< cell size near the surface in the contact grid
  std::string doubt;           ///< why the size is implausible, and the options that change it; empty: it is plausible
};

/// Conversion of a file's units to metres.
struct MeshScale {
  double scale = 1;           ///< metres per unit of the file
  double largest_size_m = 0;  ///< if positive: longest edge of the bounding box; `scale` is ignored
  bool y_is_up = false;       ///< for files that do not state their up axis
};

/// In      warn  called before anything is built, if the size is implausible, with the reason and the remedy
/// Fails   std::runtime_error that names the file and why it cannot be used
MeshFacts mesh_facts(const std::filesystem::path& file, const MeshScale& scale,
                     const std::function<void(const std::string& warning)>& warn);

/// Orthographic picture, seen obliquely from above; nearer surfaces are lighter, sheets are blue.
///
/// Out     rgb, three bytes a pixel, from top to bottom, `pixels` square
std::vector<std::uint8_t> picture_of(const geometry::ContactMesh& mesh, int pixels);

}  // namespace tandem::lab

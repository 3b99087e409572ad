// What a mesh file is, before anybody touches it: what its parts were taken for, how thin it is, what it looks like.
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
  Vec3 size_units = Vec3::Zero();  ///< as the file has it
  double scale_m = 1;              ///< of a unit of the file, or of a metre where the file states its unit
  Vec3 size_m = Vec3::Zero();
  double volume_m3 = 0;        ///< of its solids, one by one: what overlaps counts twice
  double overlap_share = 0;    ///< of the surface of its solids (wall_thickness.hpp)
  bool is_watertight = false;  ///< no sheet, and no hole that was closed
  double thinnest_wall_m = 0;  ///< of its solids (wall_thickness.hpp); 0: no solid, or no two faces of it are opposite
  double resolution_m = 0;     ///< cells near the surface that contact would have
  std::string doubt;           ///< what is odd about its size, and the options that change it; empty: nothing
};

/// How a file's numbers become metres.
struct MeshScale {
  double scale = 1;           ///< metres of a unit of the file
  double largest_size_m = 0;  ///< in place of it: the longest edge becomes that; 0: `scale` holds
  bool y_is_up = false;       ///< of files that do not state it
};

/// In      warn  called before anything is built, with a size that is doubtful and the options that change it
/// Fails   std::runtime_error that names the file and why it cannot be used
MeshFacts mesh_facts(const std::filesystem::path& file, const MeshScale& scale,
                     const std::function<void(const std::string& warning)>& warn);

/// Seen from the side and above, orthographic, the nearer the lighter; sheets are blue.
///
/// Out     rgb, three bytes a pixel, from top to bottom, `pixels` square
std::vector<std::uint8_t> picture_of(const geometry::ContactMesh& mesh, int pixels);

}  // namespace tandem::lab

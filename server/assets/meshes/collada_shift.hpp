// Positions of a .dae that are far from the origin, moved to it: Assimp reads them in single precision.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/spatial.hpp"

namespace tandem::server::mesh_reader {

struct ShiftedCollada {
  std::string text;           ///< the file, each position less `shift`
  Vec3 shift = Vec3::Zero();  ///< in the frame and units of the geometries
};

/// Nothing where no position is far from the origin, and where positions are not lists of X, Y and Z.
std::optional<ShiftedCollada> shifted_collada(std::string_view text);

}  // namespace tandem::server::mesh_reader

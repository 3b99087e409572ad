// Shifts positions of a .dae file that are far from the origin, because Assimp would read them in single precision.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/spatial.hpp"

namespace tandem::server::mesh_reader {

struct ShiftedCollada {
  std::string text;           ///< text of the file with `shift` subtracted from each position
  Vec3 shift = Vec3::Zero();  ///< offset in the frame and units of the geometries
};

/// Returns the shifted file; nothing if no position is far from the origin, or if positions are not lists of X, Y and
/// Z.
std::optional<ShiftedCollada> shifted_collada(std::string_view text);

}  // namespace tandem::server::mesh_reader

// Checks of a scene that need no further file: defaults, ranges, names and capacities.
#pragma once

#include <set>
#include <string>

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// Default value of MolecularField::dielectric.
inline constexpr const char* kDefaultDielectric = "4r";

/// Fills in every default of `scene`, and refuses the first invalid field. Each number is checked against its range
/// (proto/scene_ranges.hpp) before conditions that involve several fields.
///
/// In      scene  output of the parser; its file names are not changed
/// Fails   SceneError
void complete_and_check(wire::Scene& scene, const SceneField& file);

/// Checks of parts that occur in several kinds of objects.
void check_unique_name(const std::string& name, std::set<std::string>& taken, const SceneField& field);
void complete_mesh(wire::Mesh& mesh);
void check_mesh(const wire::Mesh& mesh, const SceneField& field);

}  // namespace tandem::server

// What can be said about a scene without opening any other file: defaults, ranges, names, capacities.
#pragma once

#include <set>
#include <string>

#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// The default of MolecularField::dielectric.
inline constexpr const char* kDefaultDielectric = "4r";

/// Fills in every default of `scene` and refuses the first field that cannot be: first what one number may be
/// (proto/scene_ranges.hpp), then what fields must be together.
///
/// In      scene  as parsed; its file names stay as written
/// Fails   SceneError
void complete_and_check(wire::Scene& scene, const SceneField& file);

/// Parts that several kinds of things have.
void check_unique_name(const std::string& name, std::set<std::string>& taken, const SceneField& field);
void complete_mesh(wire::Mesh& mesh);
void check_mesh(const wire::Mesh& mesh, const SceneField& field);

}  // namespace tandem::server

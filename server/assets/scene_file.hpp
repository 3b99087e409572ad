// Converts a scene file into everything that a room needs: checked, completed, with meshes and molecules loaded.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/workspace.hpp"
#include "common/physics/world_description.hpp"
#include "server/assets/scene_assets.hpp"
#include "server/assets/scene_field.hpp"
#include "server/physics/soft_model.hpp"
#include "server/physics/solid_shape.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// A scene ready to run. Immutable; shared by the room and the sessions.
struct LoadedScene {
  wire::Scene description;          ///< every default filled in; file names reduced to base names
  physics::WorldDescription world;  ///< the same scene for the physics: masses, contact shapes, molecules
  std::vector<std::vector<SolidShape>> body_shapes;  ///< parallel to world.bodies
  std::vector<Vec3> molecule_centres_angstrom;       ///< parallel to world.bodies: molecule's origin in its file
  std::vector<WorkspaceMapping> workspaces;          ///< parallel to world.tools
  std::vector<SoftModel> soft_bodies;                ///< parallel to description.soft_bodies()
  std::vector<Asset> assets;
  std::vector<std::string> notes;            ///< for the operator: e.g. atoms whose type was guessed, triangles read
  std::vector<std::string> notes_for_users;  ///< subset of `notes` that is shown to users: guesses, changes, omissions
};

/// Bodies with a mass.
std::vector<BodyId> moving_bodies_of(const LoadedScene& scene);

/// Least radius of gyration of a tool. It represents a pen-like object of 5 cm (length/√12), not the small tip that
/// collides: no coupling of useful stiffness could rotate the inertia of the tip stably.
inline constexpr double kToolGyrationRadius_m = 0.015;

/// Mass that the coupling of tool `tool` moves: the tool itself, or the body `held`.
physics::MovedMass moved_mass(const LoadedScene& scene, std::size_t tool, std::optional<std::size_t> held) noexcept;

/// Molecule of a body, in the frame of its file.
docking::Molecule molecule_in_its_file(const LoadedScene& scene, std::size_t body);

/// Loads, completes and checks a scene file.
/// Fails   SceneError; no error is ignored
std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file, const SceneLoading& loading = {});
/// Loads a scene from JSON text. `origin` names it in messages; `directory` is the base of relative paths.
std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory,
                                                   const SceneLoading& loading = {});

}  // namespace tandem::server

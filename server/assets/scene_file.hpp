// From a scene file to everything a room needs: checked, completed, with meshes and molecules loaded.
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
  wire::Scene description;                           ///< every default filled in; file names reduced to base names
  physics::WorldDescription world;                   ///< the same for the world: masses, contact shapes, molecules
  std::vector<std::vector<SolidShape>> body_shapes;  ///< of each of world.bodies
  std::vector<Vec3> molecule_centres_angstrom;       ///< likewise: a molecule's origin, as its file has it
  std::vector<WorkspaceMapping> workspaces;          ///< of each of world.tools
  std::vector<SoftModel> soft_bodies;                ///< parallel to description.soft_bodies()
  std::vector<Asset> assets;
  std::vector<std::string> notes;            ///< for people: e.g. atoms whose type was guessed, triangles read
  std::vector<std::string> notes_for_users;  ///< those of them that users are told: what was guessed, changed, left out
};

/// Those that have a mass.
std::vector<BodyId> moving_bodies_of(const LoadedScene& scene);

/// A tool's inertia is at least that of its mass at this distance: it stands for a pen-like thing of 5 cm
/// (length/√12), not for the small tip that collides, whose inertia no coupling of useful stiffness could turn stably.
inline constexpr double kToolGyrationRadius_m = 0.015;

/// What the coupling of tool `tool` moves while it holds body `held`, or nothing.
physics::MovedMass moved_mass(const LoadedScene& scene, std::size_t tool, std::optional<std::size_t> held) noexcept;

/// The molecule of a body, about the origin of its file.
docking::Molecule molecule_in_its_file(const LoadedScene& scene, std::size_t body);

/// Loads, completes and checks a scene file.
/// Fails   SceneError; nothing is skipped silently
std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file, const SceneLoading& loading = {});
/// The same from JSON text; `origin` names it in messages, relative paths start at `directory`.
std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory,
                                                   const SceneLoading& loading = {});

}  // namespace tandem::server

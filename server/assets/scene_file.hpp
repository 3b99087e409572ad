// Converts a scene file into the data that a room needs: checked and complete, with meshes and molecules loaded.
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

/// A scene that is ready to run. It is immutable; the room and the sessions share it.
struct LoadedScene {
  wire::Scene description;          ///< scene with all defaults; file names without folder
  physics::WorldDescription world;  ///< the scene in the form for the physics: masses, contact shapes, molecules
  std::vector<std::vector<SolidShape>> body_shapes;  ///< parallel to world.bodies
  std::vector<Vec3> molecule_centres_angstrom;       ///< parallel to world.bodies: origin of the molecule in its file
  std::vector<WorkspaceMapping> workspaces;          ///< parallel to world.tools
  std::vector<SoftModel> soft_bodies;                ///< parallel to description.soft_bodies()
  std::vector<Asset> assets;
  std::vector<std::string> notes;            ///< notes for the operator, e.g. guessed atom types, numbers of triangles
  std::vector<std::string> notes_for_users;  ///< subset of `notes` that is shown to users: guesses, changes, omissions
};

/// Returns the bodies that have a mass.
std::vector<BodyId> moving_bodies_of(const LoadedScene& scene);

/// Smallest radius of gyration of a tool: that of a pen-like object of 5 cm (length/√12). The radius of a small
/// colliding tip is much smaller, and no coupling of useful stiffness could rotate such a tool stably.
inline constexpr double kToolGyrationRadius_m = 0.015;

/// Returns the mass that the coupling of a tool moves: the mass of the tool itself, or of the held body `held`.
physics::MovedMass moved_mass(const LoadedScene& scene, std::size_t tool, std::optional<std::size_t> held) noexcept;

/// Returns the molecule of a body, in the frame of its file.
docking::Molecule molecule_in_its_file(const LoadedScene& scene, std::size_t body);

/// Loads, completes and checks a scene file.
/// Fails   SceneError, at the first error
std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file, const SceneLoading& loading = {});
/// Loads a scene from JSON text. `origin` is its name in messages; `directory` is the base of relative paths.
std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory,
                                                   const SceneLoading& loading = {});

}  // namespace tandem::server

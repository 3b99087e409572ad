// From a scene file to everything a room needs: checked, completed, with meshes and molecules loaded.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/workspace.hpp"
#include "common/docking/molecule.hpp"
#include "common/physics/touch_model.hpp"
#include "server/assets/contact_library.hpp"
#include "server/assets/mass_properties.hpp"
#include "server/assets/scene_assets.hpp"
#include "server/assets/scene_coupling.hpp"
#include "server/assets/scene_effects.hpp"
#include "server/assets/scene_field.hpp"
#include "server/physics/soft_model.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// What a scene file leaves open and the loader found: meshes by body and shape, molecules by body.
struct LoadedShape {
  Pose X_BS;
  std::shared_ptr<const geometry::TriangleMesh> mesh;  ///< for mesh shapes, repaired
  geometry::SurfaceKind mesh_kind = geometry::SurfaceKind::kSolid;
  std::shared_ptr<const contact::ContactShape> contact;  ///< null for molecules
};
struct LoadedBody {
  std::vector<LoadedShape> shapes;  ///< parallel to description.bodies(i).shapes()
  Pose X_WB;                        ///< start pose
  MassProperties mass;
  physics::TouchModel touch;
  std::shared_ptr<const docking::Molecule> molecule;  ///< origin: its centre of mass; null: feels no molecular field
};
struct LoadedTool {
  std::vector<LoadedShape> shapes;  ///< parallel to description.tools(i).shapes()
  Pose X_WT;                        ///< start pose
  MassProperties mass;              ///< see kToolGyrationRadius_m
  physics::TouchModel touch;
  WorkspaceMapping workspace;
  std::optional<std::size_t> holds_body;  ///< index into bodies
};

/// A scene ready to run. Immutable; shared by the room and the sessions.
struct LoadedScene {
  wire::Scene description;  ///< every default filled in; file names reduced to base names
  std::vector<LoadedBody> bodies;
  std::vector<LoadedTool> tools;
  std::vector<SoftModel> soft_bodies;  ///< parallel to description.soft_bodies()
  physics::SceneCoupling coupling;
  std::vector<physics::SceneEffect> effects;
  std::vector<Asset> assets;
  std::vector<std::string> notes;  ///< for people: e.g. atoms whose type was guessed, triangles read
};

/// A tool's inertia is at least that of its mass at this distance: it stands for a pen-like thing of 5 cm
/// (length/√12), not for the small tip that collides, whose inertia no coupling of useful stiffness could turn stably.
inline constexpr double kToolGyrationRadius_m = 0.015;

/// What the coupling of tool `tool` moves while it holds body `held`, or nothing.
physics::MovedMass moved_mass(const LoadedScene& scene, std::size_t tool, std::optional<std::size_t> held) noexcept;

/// Loads, completes and checks a scene file.
/// Fails   SceneError; nothing is skipped silently
std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file, const SceneLoading& loading = {});
/// The same from JSON text; `origin` names it in messages, relative paths start at `directory`.
std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory,
                                                   const SceneLoading& loading = {});

}  // namespace tandem::server

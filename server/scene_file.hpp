// From a scene file to everything a room needs: checked, completed, with meshes and molecules loaded.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/coupling.hpp"
#include "common/molecule/molecule.hpp"
#include "common/spatial.hpp"
#include "common/workspace.hpp"
#include "proto/datagram.hpp"
#include "tandem/scene.pb.h"

namespace tandem {

/// A scene that cannot be used. what() names the file, the field with its index, the value and what would be right:
///   peg.json: bodies[2].mass_kg is -1; it must be 0 (static) or more
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Sha256 = std::array<std::byte, 32>;

/// A file that the scene uses, offered to clients by the hash of its bytes.
struct Asset {
  Sha256 sha256{};
  std::string kind;  ///< "mesh" or "structure"
  std::string name;  ///< base name
  std::shared_ptr<const Bytes> bytes;
};

/// Triangles in metres, in the frame of their shape.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// What a scene file leaves open and the loader found: meshes by body and shape, molecules by body.
struct LoadedShape {
  Pose X_BS;
  std::shared_ptr<const TriangleMesh> mesh;  ///< for mesh shapes
};
struct LoadedBody {
  std::vector<LoadedShape> shapes;             ///< parallel to description.bodies(i).shapes()
  Pose X_WB;                                   ///< start pose
  std::shared_ptr<const Molecule> molecule;    ///< null: feels no molecular field
};
struct LoadedTool {
  Pose X_WT;                                   ///< start pose
  WorkspaceMapping workspace;
  std::optional<std::size_t> holds_body;       ///< index into bodies
};

/// A scene ready to run. Immutable; shared by the room and the sessions.
struct LoadedScene {
  wire::Scene description;      ///< every default filled in; file names reduced to base names
  std::vector<LoadedBody> bodies;
  std::vector<LoadedTool> tools;
  CouplingParameters coupling;
  std::vector<Asset> assets;
  std::vector<std::string> notes;  ///< for people: e.g. atoms whose type was guessed, triangles read
};

/// Loads, completes and checks a scene file.
/// Fails   SceneError; nothing is skipped silently
std::shared_ptr<const LoadedScene> load_scene(const std::filesystem::path& file);
/// The same from JSON text; `origin` names it in messages, relative paths start at `directory`.
std::shared_ptr<const LoadedScene> load_scene_text(const std::string& json, const std::string& origin,
                                                   const std::filesystem::path& directory);

Pose pose_of(const wire::Placement& placement);

}  // namespace tandem

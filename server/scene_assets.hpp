// The files that a scene names: read once, hashed, and turned into meshes and molecules.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/molecule/molecule.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "server/scene_field.hpp"
#include "common/contact/triangle_mesh.hpp"
#include "tandem/scene.pb.h"

namespace tandem {

/// A file that the scene uses, offered to clients by the hash of its bytes.
struct Asset {
  Sha256 sha256{};
  std::string kind;  ///< "mesh" or "structure"
  std::string name;  ///< base name
  std::shared_ptr<const Bytes> bytes;
};

/// Reads the files of one scene; the same file is read once.
class SceneAssets {
 public:
  /// Relative file names start at `directory`.
  explicit SceneAssets(std::filesystem::path directory) : directory_(std::move(directory)) {}

  /// Reads, scales and centres the mesh. `message` leaves with its base name and the scale that was used.
  /// Fails   SceneError: no such file, not a mesh, too large, not finite, no triangle left
  std::shared_ptr<const TriangleMesh> load_mesh(wire::Mesh& message, const SceneField& field);

  /// Reads the chosen chains; the origin is the centre of mass. `message` leaves with its base name.
  /// Fails   SceneError
  std::shared_ptr<const Molecule> load_centred_molecule(wire::MoleculeSource& message,
                                                        const std::string& force_field_directory,
                                                        const SceneField& field);

  std::vector<Asset> assets;
  std::vector<std::string> notes;  ///< for people

 private:
  /// The file's bytes, kept as an asset of `kind`.
  std::shared_ptr<const Bytes> read(const std::filesystem::path& file, const std::string& kind,
                                    const SceneField& field);
  std::filesystem::path located(const std::string& file) const;

  std::filesystem::path directory_;
  std::map<std::filesystem::path, std::shared_ptr<const Bytes>> read_;
};

}  // namespace tandem

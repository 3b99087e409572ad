// The files that a scene names: read once, hashed, and turned into meshes and molecules.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/docking/molecule.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "server/assets/contact_library.hpp"
#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// A file that the scene uses, offered to clients by the hash of its bytes.
struct Asset {
  proto::Sha256 sha256{};
  /// "mesh", "structure", "contact" (common/contact/contact_shape.hpp), "surface" (common/geometry/surface_asset.hpp),
  /// or "molecule" (common/docking/molecule_asset.hpp)
  std::string kind;
  std::string name;  ///< base name
  std::shared_ptr<const proto::Bytes> bytes;
};

/// Reads the files of one scene; the same file is read once.
class SceneAssets {
 public:
  /// Relative file names start at `directory`.
  explicit SceneAssets(std::filesystem::path directory) : directory_(std::move(directory)) {}

  /// Reads, scales, centres and repairs the mesh. `message` leaves with its base name and the scale that was used.
  /// Fails   SceneError: no such file, not a mesh, too large, not finite, beyond repair
  geometry::ContactMesh load_mesh(wire::Mesh& message, const SceneField& field);

  /// Offers `asset` to clients and writes its hash into the message of its mesh.
  void add_contact(const ContactAsset& asset, wire::Mesh& message);
  /// Likewise the triangles of `mesh`, as load_mesh() gave it; of more than a client takes there is a note instead.
  void add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message);

  /// Reads the chosen chains; the origin is the centre of mass. Offered to clients; `message` leaves with its base name
  /// and the hash of what is offered.
  /// Fails   SceneError
  std::shared_ptr<const docking::Molecule> load_centred_molecule(wire::MoleculeSource& message,
                                                                 const std::string& force_field_directory,
                                                                 const SceneField& field);

  std::vector<Asset> assets;
  std::vector<std::string> notes;  ///< for people

 private:
  /// The file's bytes, kept as an asset of `kind`.
  std::shared_ptr<const proto::Bytes> read(const std::filesystem::path& file, const std::string& kind,
                                           const SceneField& field);
  std::filesystem::path located(const std::string& file) const;
  /// False: it was there already.
  bool offer(Asset asset);
  void add_molecule(const docking::Molecule& molecule, wire::MoleculeSource& message);

  std::filesystem::path directory_;
  std::map<std::filesystem::path, std::shared_ptr<const proto::Bytes>> read_;
};

}  // namespace tandem::server

// Reads the files that a scene names: each file once, hashed, and converted to meshes and molecules. Contact shapes are
// built here: primitives in milliseconds, meshes in seconds, or at once from the cache on disk.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/folders.hpp"
#include "common/base/time.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/docking/molecule.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "server/assets/scene_field.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// Settings for loading a scene that are not part of its file.
struct SceneLoading {
  std::filesystem::path cache_directory = default_cache_directory();  ///< empty: build every time
  /// Progress callback of long tasks: the task, and the share that is done (0..1).
  std::function<void(const std::string& what, double done)> progress;
  /// Called before anything is built, with warnings that the operator may want to act on first, such as an odd scale.
  std::function<void(const std::string& warning)> warn;
  /// Limit of the total time for building the contact shapes of the scene.
  Duration max_build = Duration::max();
};

/// A file that the scene uses, offered to clients by the hash of its bytes.
struct Asset {
  proto::Sha256 sha256{};
  /// "mesh", "structure", "contact", "coarse-contact" (common/contact/contact_shape.hpp), "surface"
  /// (common/geometry/surface_asset.hpp), "drawing" (common/geometry/drawing_asset.hpp), or "molecule"
  /// (common/docking/molecule_asset.hpp)
  std::string kind;
  std::string name;  ///< base name
  std::shared_ptr<const proto::Bytes> bytes;
  std::optional<proto::Sha256>
      coarse_of{};  ///< contact shape that a "coarse-contact" replaces, or "surface" of a "drawing"
};

/// Reads the files of one scene and makes contact shapes. Each file is read once; equal shapes are made once.
class SceneAssets {
 public:
  /// In      directory  base of relative file names
  SceneAssets(std::filesystem::path directory, SceneLoading loading)
      : directory_(std::move(directory)), loading_(std::move(loading)) {}

  /// Reads, scales, centres and repairs the mesh. Writes its base name and the scale that was used into `message`.
  /// Fails   SceneError: the file is missing, not a mesh, too large, not finite, or beyond repair
  geometry::ContactMesh load_mesh(wire::Mesh& message, const SceneField& field);

  /// Contact shape of a mesh, from the cache if possible. An unreadable, damaged or foreign cache entry is built anew.
  /// A cache that cannot be written causes a note, not an error. Offers the shape to clients and writes its hash into
  /// `message`.
  /// Fails   like make_contact_mesh(); MeshError: the shapes of the scene take longer than SceneLoading::max_build
  std::shared_ptr<const contact::ContactShape> mesh_contact(const geometry::ContactMesh& mesh, wire::Mesh& message);
  /// Offers the triangles of `mesh`, as load_mesh() returned it, and its drawings; writes their hash into `message`. A
  /// mesh with more triangles than a client accepts causes a note instead.
  void add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message);

  /// Registers all molecules of a scene before the first is loaded. Their files share a frame, and hydrogens built for
  /// one avoid the atoms of the others (load_molecule()).
  void add_sources(const wire::Scene& scene);

  /// Reads the chosen chains; the origin is the centre of mass. Offers the molecule to clients, and writes its base
  /// name and hash into `message`.
  /// Out     centre_angstrom  the origin in the frame of the file
  /// Fails   SceneError
  std::shared_ptr<const docking::Molecule> load_centred_molecule(wire::MoleculeSource& message,
                                                                 const std::string& force_field_directory,
                                                                 const SceneField& field, Vec3& centre_angstrom);

  /// Adds a note that is also shown to users.
  void add_user_note(const std::string& note);

  std::vector<Asset> assets;
  std::vector<std::string> notes;            ///< for the operator
  std::vector<std::string> notes_for_users;  ///< subset of `notes`: deviations of the scene from its files

 private:
  struct Contact;

  const Contact& contact_of(const geometry::ContactMesh& mesh, double sheet_thickness_m, const std::string& name,
                            bool is_coarse);
  /// Offers a coarse contact asset, which clients touch until they have `fine`, unless it is larger than a quarter of
  /// `fine`.
  void add_coarse_contact(const geometry::ContactMesh& mesh, const wire::Mesh& message, const Contact& fine);
  /// Reads the bytes of a file and keeps them as an asset of `kind`.
  std::shared_ptr<const proto::Bytes> read(const std::filesystem::path& file, const std::string& kind,
                                           const SceneField& field);
  void add_drawings(const geometry::TriangleMesh& mesh, const wire::Mesh& message, const proto::Sha256& surface);
  std::filesystem::path located(const std::string& file) const;
  /// Adds an asset. Returns false if it was already offered.
  bool offer(Asset asset);
  void add_molecule(const docking::Molecule& molecule, wire::MoleculeSource& message);

  std::filesystem::path directory_;
  SceneLoading loading_;
  std::vector<wire::MoleculeSource> sources_;
  Duration built_{0};                                                 ///< total build time so far
  std::map<proto::Sha256, std::shared_ptr<const Contact>> contacts_;  ///< key: contact_key()
  std::map<std::filesystem::path, std::shared_ptr<const proto::Bytes>> read_;
};

}  // namespace tandem::server

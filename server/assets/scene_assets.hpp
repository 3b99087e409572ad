// Reads the files that a scene names. Each file is read once, hashed, and converted to a mesh or a molecule. Contact
// shapes are built as well. This takes milliseconds for a primitive and seconds for a mesh, unless the disk cache
// contains its shape.
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
  std::filesystem::path cache_directory = default_cache_directory();  ///< folder of the cache; empty: no cache
  /// Progress callback of long tasks. Its arguments are the task and the completed fraction of it (0..1).
  std::function<void(const std::string& what, double done)> progress;
  /// Receives warnings after which the operator may want to stop, such as an implausible scale. It is called before any
  /// contact shape is built, because building takes long.
  std::function<void(const std::string& warning)> warn;
  /// Limit of the total time for building the contact shapes of the scene.
  Duration max_build = Duration::max();
};

/// A file that the scene uses. Clients can request it by the hash of its bytes.
struct Asset {
  proto::Sha256 sha256{};
  /// one of "mesh", "structure", "contact", "coarse-contact" (common/contact/contact_shape.hpp), "surface"
  /// (common/geometry/surface_asset.hpp), "drawing" (common/geometry/drawing_asset.hpp), or "molecule"
  /// (common/docking/molecule_asset.hpp)
  std::string kind;
  std::string name;  ///< file name without folder
  std::shared_ptr<const proto::Bytes> bytes;
  std::optional<proto::Sha256>
      coarse_of{};  ///< "contact" that a "coarse-contact" replaces, or "surface" that a "drawing" shows
};

/// Reads the files of one scene and builds contact shapes. Each file is read once, and equal shapes are built once.
class SceneAssets {
 public:
  /// In      directory  base folder of relative file names
  SceneAssets(std::filesystem::path directory, SceneLoading loading)
      : directory_(std::move(directory)), loading_(std::move(loading)) {}

  /// Reads, scales, centres and repairs the mesh. Writes its name without folder and the applied scale to `message`.
  /// Fails   SceneError: the file is missing, not a mesh, too large, not finite, or beyond repair
  geometry::ContactMesh load_mesh(wire::Mesh& message, const SceneField& field);

  /// Returns the contact shape of a mesh. It is read from the cache, or built if the cache entry is missing,
  /// unreadable, damaged or from another version of the program. A failure to write the cache causes a note, not an
  /// error. The shape is offered to clients, and its hash is written to `message`.
  /// Fails   see make_contact_mesh(); MeshError: building the scene's shapes takes longer than
  ///         SceneLoading::max_build
  std::shared_ptr<const contact::ContactShape> mesh_contact(const geometry::ContactMesh& mesh, wire::Mesh& message);
  /// Offers clients the triangles of `mesh`, a result of load_mesh(), and drawings of it. Writes their hash to
  /// `message`. A mesh with more triangles than a client accepts causes a note instead.
  void add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message);

  /// Registers all molecules of a scene. Call it before the first molecule is loaded. The files of all molecules have a
  /// common frame, and hydrogens that are built for one molecule must not overlap atoms of another (load_molecule()).
  void add_sources(const wire::Scene& scene);

  /// Reads the chosen chains of a molecule, with the centre of mass as origin. Offers the molecule to clients, and
  /// writes its name without folder and its hash to `message`.
  /// Out     centre_angstrom  position of the origin in the frame of the file
  /// Fails   SceneError
  std::shared_ptr<const docking::Molecule> load_centred_molecule(wire::MoleculeSource& message,
                                                                 const std::string& force_field_directory,
                                                                 const SceneField& field, Vec3& centre_angstrom);

  /// Adds a note for the operator that users see as well.
  void add_user_note(const std::string& note);

  std::vector<Asset> assets;
  std::vector<std::string> notes;  ///< notes for the operator
  /// The subset of `notes` that describes differences between the scene and its files.
  std::vector<std::string> notes_for_users;

 private:
  struct Contact;

  const Contact& contact_of(const geometry::ContactMesh& mesh, double sheet_thickness_m, const std::string& name,
                            bool is_coarse);
  /// Makes a coarse contact asset and offers it to clients, which use it until they have received `fine`. It is not
  /// offered if it is larger than a quarter of `fine`.
  void add_coarse_contact(const geometry::ContactMesh& mesh, const wire::Mesh& message, const Contact& fine);
  /// Reads the bytes of a file and stores them as an asset of `kind`.
  std::shared_ptr<const proto::Bytes> read(const std::filesystem::path& file, const std::string& kind,
                                           const SceneField& field);
  void add_drawings(const geometry::TriangleMesh& mesh, const wire::Mesh& message, const proto::Sha256& surface);
  std::filesystem::path located(const std::string& file) const;
  /// Adds an asset to `assets`. Returns false if it is in the list already.
  bool offer(Asset asset);
  void add_molecule(const docking::Molecule& molecule, wire::MoleculeSource& message);

  std::filesystem::path directory_;
  SceneLoading loading_;
  std::vector<wire::MoleculeSource> sources_;
  Duration built_{0};                                                 ///< total build time so far
  std::map<proto::Sha256, std::shared_ptr<const Contact>> contacts_;  ///< contact shapes by contact_key()
  std::map<std::filesystem::path, std::shared_ptr<const proto::Bytes>> read_;
};

}  // namespace tandem::server

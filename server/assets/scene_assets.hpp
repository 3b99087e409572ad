// The files that a scene names: read once, hashed, and turned into meshes and molecules. Its shapes become ready for
// touch here: primitives in milliseconds, meshes in seconds, or at once from the cache on disk.
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

/// How a scene is loaded, beside what its file says.
struct SceneLoading {
  std::filesystem::path cache_directory = default_cache_directory();  ///< empty: build every time
  /// Called while something takes long: what, and how much of it is done (0..1).
  std::function<void(const std::string& what, double done)> progress;
  /// Called before anything is built, with what the operator may want to correct first, such as an odd scale.
  std::function<void(const std::string& warning)> warn;
  /// For making all shapes of the scene ready for touch.
  Duration max_build = Duration::max();
};

/// A file that the scene uses, offered to clients by the hash of its bytes.
struct Asset {
  proto::Sha256 sha256{};
  /// "mesh", "structure", "contact" and "coarse-contact" (common/contact/contact_shape.hpp), "surface" (common/geometry/surface_asset.hpp),
  /// "drawing" (common/geometry/drawing_asset.hpp), or "molecule" (common/docking/molecule_asset.hpp)
  std::string kind;
  std::string name;  ///< base name
  std::shared_ptr<const proto::Bytes> bytes;
  std::optional<proto::Sha256>
      coarse_of{};  ///< of a "coarse-contact": what it may stand for; of a "drawing": the "surface"
};

/// Reads the files of one scene and makes contact shapes; the same file is read once, and equal shapes are made once.
class SceneAssets {
 public:
  /// Relative file names start at `directory`.
  SceneAssets(std::filesystem::path directory, SceneLoading loading)
      : directory_(std::move(directory)), loading_(std::move(loading)) {}

  /// Reads, scales, centres and repairs the mesh. `message` leaves with its base name and the scale that was used.
  /// Fails   SceneError: no such file, not a mesh, too large, not finite, beyond repair
  geometry::ContactMesh load_mesh(wire::Mesh& message, const SceneField& field);

  /// Of a mesh, from the cache when it is there. An unreadable, damaged or foreign entry is built anew; a cache that
  /// cannot be written is told of in a note, and is no error. Offered to clients; `message` leaves with its hash.
  /// Fails   as make_contact_mesh(); MeshError: the scene's shapes take longer than SceneLoading::max_build
  std::shared_ptr<const contact::ContactShape> mesh_contact(const geometry::ContactMesh& mesh, wire::Mesh& message);
  /// Offers the triangles of `mesh`, as load_mesh() gave it, and what is drawn of them; writes their hash into `message`. Of
  /// more than a client takes there is a note instead.
  void add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message);

  /// Takes note of all molecules of a scene before the first is loaded: their files share a frame, and built hydrogens of one keep clear
  /// of the others (load_molecule()).
  void add_sources(const wire::Scene& scene);

  /// Reads the chosen chains; the origin is the centre of mass. Offered to clients; `message` leaves with its base name
  /// and the hash of what is offered.
  /// Out     centre_angstrom  the origin, as the file has it
  /// Fails   SceneError
  std::shared_ptr<const docking::Molecule> load_centred_molecule(wire::MoleculeSource& message,
                                                                 const std::string& force_field_directory,
                                                                 const SceneField& field, Vec3& centre_angstrom);

  /// A note that users are shown too.
  void tell_users(const std::string& note);

  std::vector<Asset> assets;
  std::vector<std::string> notes;            ///< for people
  std::vector<std::string> notes_for_users;  ///< those of what the scene has other than its files say

 private:
  struct Contact;

  const Contact& contact_of(const geometry::ContactMesh& mesh, double sheet_thickness_m, const std::string& name,
                            bool is_coarse);
  /// Offers what clients may touch until they have `fine`, unless that is hardly larger.
  void add_coarse_contact(const geometry::ContactMesh& mesh, const wire::Mesh& message, const Contact& fine);
  /// The file's bytes, kept as an asset of `kind`.
  std::shared_ptr<const proto::Bytes> read(const std::filesystem::path& file, const std::string& kind,
                                           const SceneField& field);
  void add_drawings(const geometry::TriangleMesh& mesh, const wire::Mesh& message, const proto::Sha256& surface);
  std::filesystem::path located(const std::string& file) const;
  /// False: it was there already.
  bool offer(Asset asset);
  void add_molecule(const docking::Molecule& molecule, wire::MoleculeSource& message);

  std::filesystem::path directory_;
  SceneLoading loading_;
  std::vector<wire::MoleculeSource> sources_;
  Duration built_{0};                                                 ///< what building took so far
  std::map<proto::Sha256, std::shared_ptr<const Contact>> contacts_;  ///< by what they are made of
  std::map<std::filesystem::path, std::shared_ptr<const proto::Bytes>> read_;
};

}  // namespace tandem::server

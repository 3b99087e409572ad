// Where a scene's shapes become ready for touch: primitives in milliseconds, meshes in seconds, or at once from the
// cache on disk.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/folders.hpp"
#include "common/contact/contact_shape.hpp"
#include "proto/content_hash.hpp"
#include "proto/datagram.hpp"
#include "tandem/scene.pb.h"

namespace tandem::server {

/// How a scene is loaded, beside what its file says.
struct SceneLoading {
  std::filesystem::path cache_directory = default_cache_directory();  ///< empty: build every time
  /// Called while something takes long: what, and how much of it is done (0..1).
  std::function<void(const std::string& what, double done)> progress;
};

/// A mesh's shape, and the bytes that clients get it as.
struct ContactAsset {
  std::shared_ptr<const contact::ContactShape> shape;
  std::shared_ptr<const proto::Bytes> bytes;
  proto::Sha256 sha256{};
  std::string note;  ///< for people: points, spacing, memory, seconds, from where
};

/// Makes contact shapes; equal ones are made once.
class ContactLibrary {
 public:
  explicit ContactLibrary(SceneLoading loading) : loading_(std::move(loading)) {}

  /// Of a sphere, box, cylinder or capsule.
  std::shared_ptr<const contact::ContactShape> primitive(const wire::Shape& shape);
  /// Of a mesh, from the cache when it is there. An unreadable, damaged or foreign entry is built anew; a cache that
  /// cannot be written is told of in the note, and is no error.
  /// In      name  for progress and notes
  /// Fails   as make_contact_mesh()
  ContactAsset mesh(const geometry::ContactMesh& mesh, double sheet_thickness_m, const std::string& name);

 private:
  SceneLoading loading_;
  std::map<std::array<double, 4>, std::shared_ptr<const contact::ContactShape>> primitives_;
  std::map<proto::Sha256, ContactAsset> meshes_;  ///< by what they are made of
};

}  // namespace tandem::server

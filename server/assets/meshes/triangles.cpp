#include "server/assets/meshes/triangles.hpp"

#include <assimp/BaseImporter.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "server/assets/mesh_reader.hpp"

namespace tandem::server::mesh_reader {
namespace {

constexpr const char* kPolygons = "polygons";
constexpr double kSingleStep = std::numeric_limits<float>::epsilon();

/// Restricts Assimp's file access to the given files in memory.
class GivenFiles final : public Assimp::IOSystem {
 public:
  explicit GivenFiles(std::vector<GivenFile> files) : files_(std::move(files)) {}

  bool Exists(const char* name) const override { return find(name) != nullptr; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char*) override {
    const GivenFile* const file = find(name);
    if (file == nullptr) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(file->bytes.data()), file->bytes.size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  const GivenFile* find(std::string_view name) const {
    while (name.starts_with("./") || name.starts_with("/")) name.remove_prefix(name.front() == '/' ? 1 : 2);
    const auto found = std::ranges::find(files_, name, &GivenFile::name);
    return found == files_.end() ? nullptr : &*found;
  }

  std::vector<GivenFile> files_;
};

/// Detects wrong vertex indices in a file by Assimp's log. Assimp does not fail for an index out of range: it logs an
/// error, and then uses another vertex or drops the face.
class Complaints final : public Assimp::LogStream {
 public:
  Complaints() {
    Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
    Assimp::DefaultLogger::get()->attachStream(this, kSeverity);
  }
  Complaints(const Complaints&) = delete;
  Complaints& operator=(const Complaints&) = delete;
  ~Complaints() override { Assimp::DefaultLogger::get()->detachStream(this, kSeverity); }

  void write(const char* message) override {
    const std::string_view text(message);
    const auto contains = [text](const char* words) { return text.find(words) != std::string_view::npos; };
    // Messages of the .3ds and .gltf readers; the readers of other formats throw instead.
    constexpr std::array kWrongIndex{"Vertex index overflow", "out-of-range indices"};
    is_index_wrong |= std::ranges::any_of(kWrongIndex, contains);
  }

  bool is_index_wrong = false;

 private:
  static constexpr unsigned kSeverity = Assimp::Logger::Err | Assimp::Logger::Warn;
};

/// Refuses a file. Assimp's reason is quoted in brackets.
[[noreturn]] void refuse_for(const std::string& reason) {
  constexpr std::array kWithoutTriangle{"No meshes remaining", "all meshes are orphaned", "There are no valid faces",
                                        "no data loaded"};
  const std::string in_brackets = reason.empty() ? "" : " (" + reason + ")";
  const auto contains = [&reason](const char* words) { return reason.find(words) != std::string::npos; };
  if (std::ranges::any_of(kWithoutTriangle, contains)) {
    throw Refusal("which has no triangle" + in_brackets + "; export its surface as triangles");
  }
  const bool is_other = contains("Failed to determine") || contains("No suitable reader");
  throw Refusal("which is not a mesh that can be read" + in_brackets +
                (is_other ? "; export the mesh again, in the format that its name says" : "; export the mesh again"));
}

std::span<const aiFace> faces_of(const aiMesh& part) {
  return {part.mFaces, part.mNumFaces};
}

std::size_t count_faces(const aiScene& scene) {
  std::size_t count = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    for (const aiFace& face : faces_of(*scene.mMeshes[m])) count += face.mNumIndices >= 3 ? 1 : 0;
  }
  return count;
}

struct Placed {
  const aiNode* node;
  std::size_t parent;
  Eigen::Affine3d X_WN;
  std::size_t meshes;  ///< number of meshes of this node and its descendants
};

Eigen::Affine3d pose_of(const aiMatrix4x4& m) {
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  pose.linear() << m.a1, m.a2, m.a3, m.b1, m.b2, m.b3, m.c1, m.c2, m.c3;
  pose.translation() << m.a4, m.b4, m.c4;
  return pose;
}

double largest_stretch(const Eigen::Affine3d& pose) {
  return pose.linear().cwiseAbs().rowwise().sum().maxCoeff();
}

/// Computes the poses of a scene's nodes, parents first, and collects the polygons of their meshes.
class SceneFlattener {
 public:
  SceneFlattener(const aiScene& scene, const Vec3& shift, bool has_master_scale) : scene_(scene), shift_(shift) {
    Eigen::Affine3d root = pose_of(scene.mRootNode->mTransformation);
    // Assimp scales a .3ds by the inverse of the display scale that was set in the editor. That scale is not a unit of
    // the file, so it is removed here.
    const double volume = std::abs(root.linear().determinant());
    if (has_master_scale && volume > 0) root.linear() /= std::cbrt(volume);
    // Assimp rotates every scene to y up. This rotation restores z up.
    const Eigen::Affine3d upright(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
    Eigen::Affine3d exactly_upright = Eigen::Affine3d::Identity();
    exactly_upright.linear() = upright.linear().array().round();
    nodes_.push_back({scene.mRootNode, 0, exactly_upright * root, scene.mRootNode->mNumMeshes});
  }

  Polygons flattened() {
    place_nodes();
    for (const Placed& placed : nodes_) {
      for (unsigned m = 0; m < placed.node->mNumMeshes; ++m) add(*scene_.mMeshes[placed.node->mMeshes[m]], placed);
    }
    return std::move(mesh_);
  }

 private:
  void place_nodes() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      for (unsigned c = 0; c < nodes_[i].node->mNumChildren; ++c) {
        const aiNode* const child = nodes_[i].node->mChildren[c];
        nodes_.push_back({child, i, nodes_[i].X_WN * pose_of(child->mTransformation), child->mNumMeshes});
      }
    }
    for (std::size_t i = nodes_.size() - 1; i > 0; --i) nodes_[nodes_[i].parent].meshes += nodes_[i].meshes;
    // If all meshes descend from one node, the pose of that node moves the scene as a whole. Rounding of its position
    // then does not change the shape, so this node does not count.
    for (std::size_t i = 1; i < nodes_.size(); ++i) {
      if (nodes_[i].meshes == 0 || nodes_[i].meshes == nodes_[0].meshes) continue;
      const double moved = pose_of(nodes_[i].node->mTransformation).translation().cwiseAbs().maxCoeff();
      mesh_.step = std::max(mesh_.step, moved * kSingleStep * largest_stretch(nodes_[nodes_[i].parent].X_WN));
    }
  }

  void add(const aiMesh& part, const Placed& placed) {
    const std::size_t first = mesh_.vertices.size();
    if (first + part.mNumVertices > kMaxVertices) {
      throw Refusal("which has more than " + std::to_string(kMaxVertices) + " vertices; at most " +
                    std::to_string(kMaxTriangles) + " triangles are possible");
    }
    double farthest = 0;
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const Vec3 vertex(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
      farthest = std::max(farthest, vertex.cwiseAbs().maxCoeff());
      mesh_.vertices.push_back(placed.X_WN * (vertex + shift_));
    }
    mesh_.step = std::max(mesh_.step, farthest * kSingleStep * largest_stretch(placed.X_WN));
    add_faces(part, first, placed.X_WN.linear().determinant() < 0);
  }

  /// Adds the faces of a part. The faces of a mirrored part are reversed; otherwise they would point inwards.
  void add_faces(const aiMesh& part, std::size_t first, bool is_mirrored) {
    std::vector<std::uint32_t> corners;
    for (const aiFace& face : faces_of(part)) {
      corners.clear();
      for (unsigned c = 0; c < face.mNumIndices; ++c) {
        // An index beyond the vertices of this part would refer to a vertex of the next part, so it is marked as
        // invalid.
        const bool is_here = face.mIndices[c] < part.mNumVertices;
        corners.push_back(is_here ? static_cast<std::uint32_t>(first + face.mIndices[c]) : UINT32_MAX);
      }
      if (is_mirrored) std::ranges::reverse(corners);
      mesh_.add_face(corners);
    }
  }

  const aiScene& scene_;
  const Vec3 shift_;
  std::vector<Placed> nodes_;
  Polygons mesh_;
};

/// Importer that passes polygons in memory to Assimp.
class PolygonLoader final : public Assimp::BaseImporter {
 public:
  PolygonLoader(const Polygons& mesh, const Extent& extent) : mesh_(mesh), extent_(extent) {}

  bool CanRead(const std::string& name, Assimp::IOSystem*, bool) const override { return name.ends_with(kPolygons); }

 private:
  const aiImporterDesc* GetInfo() const override {
    static const aiImporterDesc description{kPolygons, "", "", "", 0, 0, 0, 0, 0, kPolygons};
    return &description;
  }

  void InternReadFile(const std::string&, aiScene* scene, Assimp::IOSystem*) override {
    scene->mRootNode = new aiNode(kPolygons);
    scene->mRootNode->mMeshes = new unsigned[1]{0};
    scene->mRootNode->mNumMeshes = 1;
    scene->mMaterials = new aiMaterial* [1] { new aiMaterial };
    scene->mNumMaterials = 1;
    scene->mMeshes = new aiMesh* [1] { new aiMesh };
    scene->mNumMeshes = 1;
    fill(*scene->mMeshes[0]);
  }

  void fill(aiMesh& part) const {
    part.mNumVertices = static_cast<unsigned>(mesh_.vertices.size());
    part.mVertices = new aiVector3D[mesh_.vertices.size()];
    const double unit = extent_.size > 0 ? std::ldexp(1, std::ilogb(extent_.size)) : 1;
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      const Eigen::Vector3f near = ((mesh_.vertices[v] - extent_.middle) / unit).cast<float>();
      part.mVertices[v] = aiVector3D(near.x(), near.y(), near.z());
    }
    part.mPrimitiveTypes = aiPrimitiveType_TRIANGLE | aiPrimitiveType_POLYGON;
    part.mNumFaces = static_cast<unsigned>(mesh_.face_sizes.size());
    part.mFaces = new aiFace[mesh_.face_sizes.size()];
    const std::uint32_t* corner = mesh_.corners.data();
    for (std::size_t f = 0; f < mesh_.face_sizes.size(); corner += mesh_.face_sizes[f], ++f) {
      part.mFaces[f].mNumIndices = mesh_.face_sizes[f];
      part.mFaces[f].mIndices = new unsigned[mesh_.face_sizes[f]];
      std::copy_n(corner, mesh_.face_sizes[f], part.mFaces[f].mIndices);
    }
  }

  const Polygons& mesh_;
  const Extent& extent_;
};

/// Returns, for each vertex, the index of its position in the list of distinct positions.
std::vector<int> places_of(const std::vector<Vec3>& vertices) {
  // -0.0 + 0.0 is 0.0, so both zeros get the same hash.
  const auto hash = [](const Vec3& p) {
    std::size_t sum = 0;
    for (const double x : p) sum = sum * 0x9E3779B97F4A7C15U + std::hash<double>()(x + 0.0);
    return sum;
  };
  std::unordered_map<Vec3, int, decltype(hash)> numbers(vertices.size(), hash);
  std::vector<int> places;
  places.reserve(vertices.size());
  for (const Vec3& vertex : vertices) {
    places.push_back(numbers.try_emplace(vertex, static_cast<int>(numbers.size())).first->second);
  }
  return places;
}

/// Merges vertices at equal positions. The result contains only vertices that triangles use, in the order of their
/// first use.
geometry::TriangleMesh joined(const std::vector<Vec3>& vertices, const std::vector<std::uint32_t>& corners) {
  geometry::TriangleMesh mesh;
  const std::vector<int> places = places_of(vertices);
  std::vector<int> used(vertices.size(), -1);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    int& number = used[static_cast<std::size_t>(places[corners[i]])];
    if (number < 0) {
      number = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(vertices[corners[i]]);
    }
    if (i % 3 == 0) mesh.triangles.emplace_back();
    mesh.triangles.back()[i % 3] = number;
  }
  return mesh;
}

}  // namespace

Polygons polygons_of_scene(const std::vector<GivenFile>& files, std::optional<std::size_t> expected_faces,
                           const Vec3& shift) {
  Complaints complaints;
  Assimp::Importer importer;
  importer.SetIOHandler(new GivenFiles(files));
  const aiScene* const scene = importer.ReadFile(files.front().name, 0);
  if (complaints.is_index_wrong) {
    throw Refusal("which has a face with an index beyond its last vertex; export the mesh again");
  }
  if (scene == nullptr || scene->mRootNode == nullptr) refuse_for(importer.GetErrorString());
  if (expected_faces && *expected_faces != count_faces(*scene)) {
    throw Refusal("whose meshes have " + std::to_string(*expected_faces) + " triangles, of which its parser gives " +
                  std::to_string(count_faces(*scene)) + "; export it as triangles without extensions");
  }
  const bool is_3ds = files.front().name.ends_with("3ds");
  Polygons mesh = SceneFlattener(*scene, shift, is_3ds).flattened();
  // Vertices of a .3ds are single-precision numbers in the frame of the scene.
  if (is_3ds) mesh.number_step = kSingleStep;
  return mesh;
}

geometry::TriangleMesh triangulated(const Polygons& mesh) {
  const bool is_cut = std::ranges::all_of(mesh.face_sizes, [](std::uint32_t size) { return size == 3; });
  if (is_cut) return joined(mesh.vertices, mesh.corners);
  const Extent extent = extent_of(mesh);
  Assimp::Importer importer;
  importer.RegisterLoader(new PolygonLoader(mesh, extent));
  const aiScene* const scene = importer.ReadFileFromMemory("", 1, aiProcess_Triangulate, kPolygons);
  if (scene == nullptr || scene->mNumMeshes != 1) refuse_for(importer.GetErrorString());
  std::vector<std::uint32_t> corners;
  for (const aiFace& face : faces_of(*scene->mMeshes[0])) {
    if (face.mNumIndices == 3) corners.insert(corners.end(), face.mIndices, face.mIndices + 3);
  }
  return joined(mesh.vertices, corners);
}

std::optional<geometry::TriangleMesh> assimp_triangles(const std::vector<GivenFile>& files,
                                                       std::size_t expected_faces) {
  Assimp::Importer importer;
  importer.SetIOHandler(new GivenFiles(files));
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(files.front().name, 0);
  if (scene == nullptr || count_faces(*scene) != expected_faces) return std::nullopt;
  scene = importer.ApplyPostProcessing(aiProcess_RemoveComponent | aiProcess_PreTransformVertices |
                                       aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  if (scene == nullptr) return std::nullopt;
  geometry::TriangleMesh all;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const auto first = static_cast<int>(all.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v)
      all.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
    for (const aiFace& face : faces_of(part)) {
      if (face.mNumIndices != 3) continue;
      const auto corner = [&](unsigned i) { return first + static_cast<int>(face.mIndices[i]); };
      all.triangles.push_back({corner(0), corner(1), corner(2)});
    }
  }
  return all;
}

}  // namespace tandem::server::mesh_reader

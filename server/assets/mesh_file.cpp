#include "server/assets/mesh_file.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cstdint>
#include <fstream>
#include <stdexcept>

namespace tandem::server {
namespace {

// A client must be able to fetch an asset, and the server to build contact of it, in reasonable time.
constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;
constexpr std::size_t kMaxTriangles = 1'000'000;

/// What to install when a file of a known data package is missing.
std::string remedy_for(const std::filesystem::path& file, const std::string& otherwise) {
  const std::string text = file.string();
  const auto is_below = [&text](const char* folder) { return text.rfind(folder, 0) == 0; };
  if (is_below("/usr/share/glmark2/")) return "install Debian package glmark2-data";
  if (is_below("/usr/share/pymol/")) return "install Debian package pymol-data";
  if (is_below("/usr/share/gromacs/")) return "install Debian package gromacs-data";
  return otherwise;
}

/// Assimp's triangles of all its meshes in one list, in file units.
geometry::TriangleMesh triangles_of(const aiScene& scene) {
  geometry::TriangleMesh mesh;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    const int first = static_cast<int>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      mesh.vertices.emplace_back(part.mVertices[v].x, part.mVertices[v].y, part.mVertices[v].z);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      const auto index = [&face, first](int corner) { return first + static_cast<int>(face.mIndices[corner]); };
      mesh.triangles.push_back({index(0), index(1), index(2)});
    }
  }
  return mesh;
}

/// Positions only, so that corners that differ in colour or normal join; nodes flattened into one frame.
geometry::TriangleMesh import_mesh(const std::vector<std::byte>& bytes, const std::filesystem::path& file) {
  if (bytes.empty()) throw std::runtime_error(file.string() + ", which is empty; export the mesh again");
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                                          aiComponent_TEXTURES | aiComponent_LIGHTS |
                                                          aiComponent_CAMERAS | aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  std::string format = file.extension().string();
  if (!format.empty()) format.erase(0, 1);
  // From memory: what collides is then exactly the asset that clients get, and no second file is opened.
  const aiScene* const scene =
      importer.ReadFileFromMemory(bytes.data(), bytes.size(),
                                  aiProcess_RemoveComponent | aiProcess_PreTransformVertices | aiProcess_Triangulate |
                                      aiProcess_JoinIdenticalVertices | aiProcess_SortByPType,
                                  format.c_str());
  if (scene == nullptr || scene->mNumMeshes == 0) {
    const std::string reason = importer.GetErrorString();
    throw std::runtime_error(file.string() + ", which is not a mesh that can be read" +
                             (reason.empty() ? "" : " (" + reason + ")") + "; give a file such as .obj, .ply or .stl");
  }
  return triangles_of(*scene);
}

void check(const geometry::TriangleMesh& mesh, const std::filesystem::path& file) {
  if (mesh.triangles.size() > kMaxTriangles) {
    throw std::runtime_error(file.string() + ", which has " + std::to_string(mesh.triangles.size()) +
                             " triangles; at most " + std::to_string(kMaxTriangles) + " are possible");
  }
  for (const Vec3& vertex : mesh.vertices) {
    if (!is_finite(vertex)) {
      throw std::runtime_error(file.string() + ", which has a vertex that is not finite; repair the mesh");
    }
  }
}

}  // namespace

std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error(file.string() + ", which does not exist; " + remedy_for(file, remedy));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > kMaxFileBytes) {
    throw std::runtime_error(file.string() + ", which is too large; at most " + std::to_string(kMaxFileBytes >> 20U) +
                             " MiB are possible");
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) throw std::runtime_error(file.string() + ", which cannot be read; check its permissions");
  return bytes;
}

geometry::TriangleMesh mesh_of_bytes(const std::vector<std::byte>& bytes, const std::filesystem::path& file) {
  geometry::TriangleMesh mesh = import_mesh(bytes, file);
  check(mesh, file);
  return mesh;
}

geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy) {
  return mesh_of_bytes(read_asset_file(file, remedy), file);
}

}  // namespace tandem::server

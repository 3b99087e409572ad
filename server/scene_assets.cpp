#include "server/scene_assets.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <fstream>
#include <limits>

#include "common/molecule/loader.hpp"

namespace tandem {
namespace {

// A client must be able to fetch an asset in reasonable time, and Bullet's triangle tree stay in the cache.
constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;
constexpr std::size_t kMaxTriangles = 1'000'000;

/// What to install when a file of a known data package is missing.
std::string remedy_for(const std::filesystem::path& file) {
  const std::string text = file.string();
  const auto is_below = [&text](const char* folder) { return text.rfind(folder, 0) == 0; };
  if (is_below("/usr/share/glmark2/")) return "install Debian package glmark2-data";
  if (is_below("/usr/share/pymol/")) return "install Debian package pymol-data";
  if (is_below("/usr/share/gromacs/")) return "install Debian package gromacs-data";
  return "give a file that is there, absolute or relative to the scene file";
}

/// Assimp's triangles of all its meshes in one list, in file units.
TriangleMesh triangles_of(const aiScene& scene) {
  TriangleMesh mesh;
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
TriangleMesh import_mesh(const Bytes& bytes, const std::filesystem::path& file, const SceneField& field) {
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
    field.refuse("is " + file.string() + ", which is not a mesh that can be read (" + importer.GetErrorString() +
                 "); give a file such as .obj, .ply or .stl");
  }
  return triangles_of(*scene);
}

void check_vertices(const TriangleMesh& mesh, const std::filesystem::path& file, const SceneField& field) {
  if (mesh.triangles.size() > kMaxTriangles) {
    field.refuse("is " + file.string() + ", which has " + std::to_string(mesh.triangles.size()) +
                 " triangles; at most " + std::to_string(kMaxTriangles) + " are possible");
  }
  for (const Vec3& vertex : mesh.vertices) {
    if (!is_finite(vertex))
      field.refuse("is " + file.string() + ", which has a vertex that is not finite; repair the mesh");
  }
}

/// Removes triangles without area (they have no normal); returns how many.
std::size_t drop_degenerate(TriangleMesh& mesh) {
  const auto is_degenerate = [&mesh](const std::array<int, 3>& triangle) {
    const auto at = [&](int corner) {
      return mesh.vertices[static_cast<std::size_t>(triangle[static_cast<std::size_t>(corner)])];
    };
    const Vec3 ab = at(1) - at(0), ac = at(2) - at(0);
    // Thinner than a millionth of its length: below what single-precision files resolve.
    const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
    return ab.cross(ac).norm() <= 1e-6 * longest;
  };
  return std::erase_if(mesh.triangles, is_degenerate);
}

struct Bounds {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
};

/// Of the vertices that triangles use: a stray vertex must not change the size.
Bounds bounds_of(const TriangleMesh& mesh) {
  Bounds bounds;
  for (const auto& triangle : mesh.triangles) {
    for (const int index : triangle) {
      const Vec3& vertex = mesh.vertices[static_cast<std::size_t>(index)];
      bounds.low = bounds.low.cwiseMin(vertex);
      bounds.high = bounds.high.cwiseMax(vertex);
    }
  }
  return bounds;
}

/// Scales and centres as the scene asks, and writes the scale that came of it into `message`.
void place(TriangleMesh& mesh, wire::Mesh& message, const std::filesystem::path& file, const SceneField& field) {
  const Bounds bounds = bounds_of(mesh);
  const double largest = (bounds.high - bounds.low).maxCoeff();
  if (message.largest_size_m() > 0) message.set_scale(message.largest_size_m() / largest);
  message.set_largest_size_m(largest * message.scale());
  if (!(message.largest_size_m() <= 100)) {
    field.refuse("is " + file.string() + ", which is " + number_text(message.largest_size_m()) +
                 " m large; give largest_size_m or a smaller scale");
  }
  const Vec3 centre = message.centre() ? Vec3((bounds.low + bounds.high) / 2) : Vec3(Vec3::Zero());
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - centre) * message.scale();
}

}  // namespace

std::filesystem::path SceneAssets::located(const std::string& file) const {
  return (directory_ / file).lexically_normal();
}

std::shared_ptr<const Bytes> SceneAssets::read(const std::filesystem::path& file, const std::string& kind,
                                               const SceneField& field) {
  if (const auto found = read_.find(file); found != read_.end()) return found->second;
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    field.refuse("is " + file.string() + ", which does not exist; " + remedy_for(file));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > kMaxFileBytes) {
    field.refuse("is " + file.string() + ", which is too large; at most " + std::to_string(kMaxFileBytes >> 20U) +
                 " MiB are possible");
  }
  auto bytes = std::make_shared<Bytes>(static_cast<std::size_t>(size));
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes->data()), static_cast<std::streamsize>(size));
  if (!stream) field.refuse("is " + file.string() + ", which cannot be read; check its permissions");

  const Asset asset{sha256_of(*bytes), kind, file.filename().string(), bytes};
  // Clients tell assets apart by their base name, which is all they see of the path.
  const auto same_name = [&asset](const Asset& other) { return other.name == asset.name; };
  const auto clash = std::find_if(assets.begin(), assets.end(), same_name);
  if (clash != assets.end() && clash->sha256 != asset.sha256) {
    field.refuse("is " + file.string() +
                 ", which has the name of another, different file of the scene; rename one of them");
  }
  if (clash == assets.end()) assets.push_back(asset);
  read_.emplace(file, bytes);
  return bytes;
}

std::shared_ptr<const TriangleMesh> SceneAssets::load_mesh(wire::Mesh& message, const SceneField& field) {
  const SceneField file_field = field.in("file");
  const std::filesystem::path file = located(message.file());
  const auto bytes = read(file, "mesh", file_field);
  auto mesh = std::make_shared<TriangleMesh>(import_mesh(*bytes, file, file_field));
  check_vertices(*mesh, file, file_field);
  const std::size_t dropped = drop_degenerate(*mesh);
  if (mesh->triangles.empty())
    file_field.refuse("is " + file.string() + ", which has no triangle; give a surface mesh");
  place(*mesh, message, file, file_field);
  message.set_file(file.filename().string());
  notes.push_back(message.file() + ": " + std::to_string(mesh->triangles.size()) + " triangles" +
                  (dropped > 0 ? ", " + std::to_string(dropped) + " without area left out" : ""));
  return mesh;
}

std::shared_ptr<const Molecule> SceneAssets::load_centred_molecule(wire::MoleculeSource& message,
                                                                   const std::string& force_field_directory,
                                                                   const SceneField& field) {
  const SceneField file_field = field.in("file");
  const std::filesystem::path file = located(message.file());
  read(file, "structure", file_field);
  auto molecule = std::make_shared<Molecule>();
  try {
    const StructureSelection selection{{message.chains().begin(), message.chains().end()}};
    *molecule = load_molecule(file, selection, force_field_directory);
  } catch (const MoleculeError& error) {
    field.refuse(std::string("cannot be used: ") + error.what());
  }
  const Vec3 centre = molecule->centre_of_mass_angstrom();
  for (Vec3& position : molecule->positions_angstrom) position -= centre;
  message.set_file(file.filename().string());
  notes.push_back(message.file() + ": " + std::to_string(molecule->size()) + " atoms, force field " +
                  molecule->force_field);
  for (const GuessedType& guess : molecule->guessed) notes.push_back(message.file() + ": " + guess.reason);
  return molecule;
}

}  // namespace tandem

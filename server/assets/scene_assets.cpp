#include "server/assets/scene_assets.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "common/base/units.hpp"
#include "common/docking/molecule_asset.hpp"
#include "common/geometry/surface_asset.hpp"
#include "server/assets/mesh_file.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::server {
namespace {

/// What `read` gives; what it says against the file becomes a refusal of the field.
template <class Read>
auto or_refused(const SceneField& field, const Read& read) {
  try {
    return read();
  } catch (const std::runtime_error& error) {
    field.refuse(std::string("is ") + error.what());
  }
}

struct Bounds {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
};

/// Of the vertices that triangles use: a stray vertex must not change the size.
Bounds bounds_of(const geometry::TriangleMesh& mesh) {
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
void place(geometry::TriangleMesh& mesh, wire::Mesh& message, const std::filesystem::path& file,
           const SceneField& field) {
  const Bounds bounds = bounds_of(mesh);
  const double largest = (bounds.high - bounds.low).maxCoeff();
  if (message.largest_size_m() > 0) message.set_scale(message.largest_size_m() / largest);
  message.set_largest_size_m(largest * message.scale());
  // Clients are sent both, and check them by the same ranges.
  if (!proto::scene_range("Mesh.largest_size_m").accepts(message.largest_size_m())) {
    field.refuse("is " + file.string() + ", which is " + number_text(message.largest_size_m()) +
                 " m large; give largest_size_m or a smaller scale");
  }
  if (const proto::SceneRange& range = proto::scene_range("Mesh.scale"); !range.accepts(message.scale())) {
    field.refuse("is " + file.string() + ", which is " + number_text(largest) + " units large and needs a scale of " +
                 number_text(message.scale()) + "; at most " + number_text(range.high) +
                 " is possible: give a smaller largest_size_m");
  }
  const Vec3 centre = message.centre() ? Vec3((bounds.low + bounds.high) / 2) : Vec3(Vec3::Zero());
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - centre) * message.scale();
}

/// The same mesh may be there in several sizes, and names must differ.
std::string sized_name(const wire::Mesh& message) {
  return message.file() + "." + std::to_string(std::llround(message.largest_size_m() * 1e6)) + "um";
}

}  // namespace

std::filesystem::path SceneAssets::located(const std::string& file) const {
  return (directory_ / file).lexically_normal();
}

std::shared_ptr<const proto::Bytes> SceneAssets::read(const std::filesystem::path& file, const std::string& kind,
                                                      const SceneField& field) {
  if (const auto found = read_.find(file); found != read_.end()) return found->second;
  const std::string remedy = "give a file that is there, absolute or relative to the scene file";
  auto bytes = std::make_shared<const proto::Bytes>(or_refused(field, [&] { return read_asset_file(file, remedy); }));

  const Asset asset{proto::sha256_of(*bytes), kind, file.filename().string(), bytes};
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

geometry::ContactMesh SceneAssets::load_mesh(wire::Mesh& message, const SceneField& field) {
  const SceneField file_field = field.in("file");
  const std::filesystem::path file = located(message.file());
  const auto bytes = read(file, "mesh", file_field);
  geometry::TriangleMesh mesh = or_refused(file_field, [&] { return mesh_of_bytes(*bytes, file); });
  if (mesh.triangles.empty()) file_field.refuse("is " + file.string() + ", which has no triangle; give a surface mesh");
  place(mesh, message, file, file_field);
  message.set_file(file.filename().string());
  try {
    geometry::ContactMesh repaired_mesh = geometry::repaired(mesh);
    notes.push_back(message.file() + ": " + counted(repaired_mesh.mesh.triangles.size(), "triangle", "triangles") +
                    ", a " + (repaired_mesh.kind == geometry::SurfaceKind::kSolid ? "solid" : "sheet"));
    for (const std::string& note : repaired_mesh.notes) notes.push_back(message.file() + ": " + note);
    return repaired_mesh;
  } catch (const geometry::MeshError& error) {
    file_field.refuse("is " + file.string() + ", which cannot be touched: " + error.what());
  }
}

void SceneAssets::add_contact(const ContactAsset& asset, wire::Mesh& message) {
  message.set_contact_sha256(asset.sha256.data(), asset.sha256.size());
  if (offer({asset.sha256, "contact", sized_name(message) + ".contact", asset.bytes})) {
    notes.push_back(message.file() + ": " + asset.note);
  }
}

void SceneAssets::add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message) {
  try {
    const auto bytes = std::make_shared<const proto::Bytes>(geometry::surface_asset_bytes(mesh));
    const proto::Sha256 hash = proto::sha256_of(*bytes);
    message.set_surface_sha256(hash.data(), hash.size());
    offer({hash, std::string(geometry::kSurfaceAssetKind), sized_name(message) + ".surface", bytes});
  } catch (const std::invalid_argument& error) {
    notes.push_back(message.file() + ": " + error.what() +
                    ", so clients can neither draw it nor touch it with a point");
  }
}

bool SceneAssets::offer(Asset asset) {
  const auto is_same = [&asset](const Asset& other) { return other.sha256 == asset.sha256; };
  if (std::any_of(assets.begin(), assets.end(), is_same)) return false;
  assets.push_back(std::move(asset));
  return true;
}

std::shared_ptr<const docking::Molecule> SceneAssets::load_centred_molecule(wire::MoleculeSource& message,
                                                                            const std::string& force_field_directory,
                                                                            const SceneField& field) {
  const SceneField file_field = field.in("file");
  const std::filesystem::path file = located(message.file());
  read(file, "structure", file_field);
  auto molecule = std::make_shared<docking::Molecule>();
  try {
    *molecule = load_molecule(file, {message.chains().begin(), message.chains().end()}, force_field_directory);
  } catch (const docking::MoleculeError& error) {
    field.refuse(std::string("cannot be used: ") + error.what());
  }
  const Vec3 centre = molecule->centre_of_mass_angstrom();
  for (Vec3& position : molecule->positions_angstrom) position -= centre;
  message.set_file(file.filename().string());
  notes.push_back(message.file() + ": " + std::to_string(molecule->size()) + " atoms, force field " +
                  molecule->force_field);
  for (const auto& [atom, reason] : molecule->guessed) notes.push_back(message.file() + ": " + reason);
  try {
    add_molecule(*molecule, message);
  } catch (const std::invalid_argument& error) {
    field.refuse(std::string("cannot be used: ") + error.what());
  }
  return molecule;
}

void SceneAssets::add_molecule(const docking::Molecule& molecule, wire::MoleculeSource& message) {
  const auto bytes = std::make_shared<const proto::Bytes>(docking::molecule_asset_bytes(molecule));
  const proto::Sha256 hash = proto::sha256_of(*bytes);
  message.set_asset_sha256(hash.data(), hash.size());
  // The same file may be there with several choices of chains, and names must differ.
  std::string name = message.file();
  for (const std::string& chain : message.chains()) name += "." + chain;
  offer({hash, "molecule", name + ".molecule", bytes});
}

}  // namespace tandem::server

#include "server/assets/scene_assets.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "common/base/byte_io.hpp"
#include "common/base/units.hpp"
#include "common/docking/molecule_asset.hpp"
#include "common/geometry/drawing_asset.hpp"
#include "common/geometry/repair/mesh_bounds.hpp"
#include "common/geometry/surface_asset.hpp"
#include "proto/world_from_wire.hpp"
#include "server/assets/contact_cache.hpp"
#include "server/assets/mesh_file.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::server {
namespace {

/// Mesh size above which cell sizes and point spacings grow in proportion to the size. Constant cell sizes would need
/// too much memory for large meshes.
constexpr double kFullResolutionSize_m = 0.2;
constexpr const char* kMillimetres = "0.001 if the file is in millimetres";

/// Size of a contact asset [bytes] above which a coarse asset is made as well. Clients use the coarse asset until they
/// have received the full one. The factors below are multiples of the cell size, the tolerance and the point spacing of
/// the full asset.
constexpr std::size_t kMaxBytesWithoutCoarse = 200 * 1024;
constexpr double kCoarseCells = 4;
constexpr double kCoarseTolerance = 8;
constexpr double kCoarsePoints = 3;

contact::ContactShapeOptions coarser(contact::ContactShapeOptions options) {
  options.cell_m *= kCoarseCells;
  options.tolerance_m *= kCoarseTolerance;
  options.band_m = std::max(options.band_m, options.cell_m);
  options.spacing_m *= kCoarsePoints;
  options.feature_spacing_m *= kCoarsePoints;
  options.feature_height_m *= kCoarsePoints;
  options.refines_rods = false;
  return options;
}

contact::ContactShapeOptions options_for(const geometry::ContactMesh& mesh, double sheet_thickness_m) {
  Vec3 low = mesh.mesh.vertices.front(), high = low;
  for (const Vec3& vertex : mesh.mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  const double scale = std::max(1.0, (high - low).maxCoeff() / kFullResolutionSize_m);
  contact::ContactShapeOptions options;
  options.cell_m *= scale;
  options.tolerance_m *= scale;
  options.band_m *= scale;
  options.sheet_thickness_m = sheet_thickness_m;
  options.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.spacing_m *= scale;
  options.feature_spacing_m *= scale;
  options.feature_height_m *= scale;
  return options;
}

std::string describe(const contact::ContactShape& shape, const std::string& from, double seconds) {
  std::ostringstream out;
  out << "contact " << from << " in " << std::fixed << std::setprecision(2) << seconds
      << " s: " << shape.shells.surface.points.size() << " points every " << shape.shells.surface.spacing_m * 1e3
      << " mm, " << std::setprecision(1) << static_cast<double>(shape.memory_bytes()) / (1 << 20U) << " MiB";
  return out.str();
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Calls `read`, and converts a std::runtime_error to a refusal of the scene field.
template <class Read>
auto or_refused(const SceneField& field, const Read& read) {
  try {
    return read();
  } catch (const std::runtime_error& error) {
    field.refuse(std::string("is ") + error.what());
  }
}

/// Stops a build that takes too long, by an exception. It is called in the progress callback of the build, and the
/// partial result is discarded.
[[noreturn]] void refuse_long_build(Duration allowed, double done) {
  throw geometry::MeshError("the scene's meshes take longer than " + number_text(to_seconds(allowed)) +
                            " s to be made ready for touch, and this one was done by " +
                            std::to_string(static_cast<int>(100 * done)) +
                            " %: simplify it, give a smaller largest_size_m, or allow more (--build-limit)");
}

/// Returns the bounding box of a mesh. Refuses a mesh of size 0, because its size is a divisor.
Eigen::AlignedBox3d measured(const geometry::TriangleMesh& mesh, const std::filesystem::path& file,
                             const SceneField& field) {
  try {
    return geometry::mesh_bounds(mesh);
  } catch (const geometry::MeshError& error) {
    field.refuse("is " + file.string() + ", which has no size: " + error.what());
  }
}

/// Scales and centres the mesh as the scene specifies. Writes the resulting scale and size to `message`.
void place(geometry::TriangleMesh& mesh, wire::Mesh& message, const std::filesystem::path& file,
           const SceneField& field) {
  const Eigen::AlignedBox3d bounds = measured(mesh, file, field);
  const double largest = bounds.sizes().maxCoeff();
  if (message.largest_size_m() > 0) message.set_scale(message.largest_size_m() / largest);
  message.set_largest_size_m(largest * message.scale());
  // Clients check both the scale and the size against these ranges, so the server checks both as well.
  if (!proto::scene_range("Mesh.largest_size_m").accepts(message.largest_size_m())) {
    field.refuse("is " + file.string() + ", which is " + number_text(message.largest_size_m()) +
                 " m large; give largest_size_m or another scale (" + kMillimetres + ")");
  }
  if (const proto::SceneRange& range = proto::scene_range("Mesh.scale"); !range.accepts(message.scale())) {
    field.refuse("is " + file.string() + ", which is " + number_text(largest) + " units large and needs a scale of " +
                 number_text(message.scale()) + "; at most " + number_text(range.high) +
                 " is possible: give a smaller largest_size_m, or export the mesh in a smaller unit");
  }
  const Vec3 centre = message.centre() ? Vec3(bounds.center()) : Vec3(Vec3::Zero());
  for (Vec3& vertex : mesh.vertices) vertex = (vertex - centre) * message.scale();
}

/// Returns a warning if the file is probably in another unit (millimetres instead of metres, or the reverse); empty if
/// the size is plausible.
std::string size_warning(const wire::Mesh& message) {
  const std::string doubt = doubt_of_size(message.largest_size_m(), message.scale(), message.file());
  if (doubt.empty()) return doubt;
  const std::string millimetres =
      is_too_large(message.largest_size_m()) ? std::string(" (") + kMillimetres + ")" : std::string();
  return message.file() + ": " + doubt + " Else give the mesh scale" + millimetres + " or largest_size_m";
}

/// Returns the file name with the size appended, because a scene may use one mesh in several sizes.
std::string sized_name(const wire::Mesh& message) {
  return message.file() + "." + std::to_string(std::llround(message.largest_size_m() * 1e6)) + "um";
}

}  // namespace

/// Contact shape of a mesh, and the bytes of its asset for clients.
struct SceneAssets::Contact {
  std::shared_ptr<const contact::ContactShape> shape;
  std::shared_ptr<const proto::Bytes> bytes;
  proto::Sha256 sha256{};
  std::string note;  ///< note for the operator: points, spacing, memory, build time, built or cached
};

std::filesystem::path SceneAssets::located(const std::string& file) const {
  return (directory_ / file).lexically_normal();
}

std::shared_ptr<const proto::Bytes> SceneAssets::read(const std::filesystem::path& file, const std::string& kind,
                                                      const SceneField& field) {
  if (const auto found = read_.find(file); found != read_.end()) return found->second;
  const std::string remedy = "give an existing file, absolute or relative to the scene file";
  auto bytes = std::make_shared<const proto::Bytes>(or_refused(field, [&] { return read_asset_file(file, remedy); }));

  const Asset asset{proto::sha256_of(*bytes), kind, file.filename().string(), bytes};
  // Clients receive the name without its folder, so the name alone must identify the asset.
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
  const bool is_scaled = message.largest_size_m() == 0;
  place(mesh, message, file, file_field);
  message.set_file(file.filename().string());
  if (const std::string warning = is_scaled ? size_warning(message) : ""; !warning.empty()) {
    notes.push_back(warning);
    if (loading_.warn) loading_.warn(warning);
  }
  try {
    geometry::ContactMesh repaired_mesh = geometry::repaired(mesh);
    for (const std::string& line : geometry::part_lines(repaired_mesh)) notes.push_back(message.file() + ": " + line);
    for (const std::string& note : repaired_mesh.notes) add_user_note(message.file() + ": " + note);
    return repaired_mesh;
  } catch (const geometry::MeshError& error) {
    file_field.refuse("is " + file.string() + ", which cannot be touched: " + error.what());
  }
}

const SceneAssets::Contact& SceneAssets::contact_of(const geometry::ContactMesh& mesh, double sheet_thickness_m,
                                                    const std::string& name, bool is_coarse) {
  const contact::ContactShapeOptions fine = options_for(mesh, sheet_thickness_m);
  const contact::ContactShapeOptions options = is_coarse ? coarser(fine) : fine;
  const proto::Sha256 key = contact_key(mesh, options);
  std::shared_ptr<const Contact>& entry = contacts_[key];
  if (entry) return *entry;
  const auto begin = std::chrono::steady_clock::now();
  const std::filesystem::path cached =
      loading_.cache_directory.empty() ? "" : kept_contact_file(loading_.cache_directory, key);

  Contact asset;
  std::vector<std::uint8_t> bytes = cached.empty() ? std::vector<std::uint8_t>{} : read_kept_contact(cached, key);
  if (!bytes.empty()) asset.shape = contact::contact_shape_from(bytes);
  if (asset.shape) {
    asset.note = describe(*asset.shape, "from cache", seconds_since(begin));
  } else {
    const SteadyClock clock;
    const LocalTime started = clock.now();
    const auto progress = [&](double done) {
      if (loading_.progress) loading_.progress("building contact of " + name, done);
      if (clock.now() - started > loading_.max_build - built_) refuse_long_build(loading_.max_build, done);
    };
    asset.shape = contact::make_contact_mesh(mesh, options, progress);
    built_ += clock.now() - started;
    asset.note = describe(*asset.shape, "built", seconds_since(begin));
    bytes = contact::contact_asset_bytes(*asset.shape);
    if (!cached.empty() && keep_contact(cached, key, bytes)) {
      asset.note += "; " + cached.string() + " cannot be written, so the next start builds it again";
    }
  }
  asset.bytes = std::make_shared<const proto::Bytes>(bytes_of(bytes));
  asset.sha256 = proto::sha256_of(*asset.bytes);
  entry = std::make_shared<const Contact>(std::move(asset));
  return *entry;
}

std::shared_ptr<const contact::ContactShape> SceneAssets::mesh_contact(const geometry::ContactMesh& mesh,
                                                                       wire::Mesh& message) {
  const Contact& asset = contact_of(mesh, message.sheet_thickness_m(), message.file(), false);
  message.set_contact_sha256(asset.sha256.data(), asset.sha256.size());
  if (offer({asset.sha256, "contact", sized_name(message) + ".contact", asset.bytes})) {
    notes.push_back(message.file() + ": " + asset.note);
    if (asset.bytes->size() > kMaxBytesWithoutCoarse) add_coarse_contact(mesh, message, asset);
  }
  return asset.shape;
}

void SceneAssets::add_coarse_contact(const geometry::ContactMesh& mesh, const wire::Mesh& message,
                                     const Contact& fine) {
  try {
    const Contact& coarse = contact_of(mesh, message.sheet_thickness_m(), message.file(), true);
    if (coarse.bytes->size() > fine.bytes->size() / 4) return;
    offer({coarse.sha256, "coarse-contact", sized_name(message) + ".coarse", coarse.bytes, fine.sha256});
  } catch (const std::exception& problem) {
    notes.push_back(message.file() +
                    ": users who join wait for its whole contact shape: no coarse one can be made: " + problem.what());
  }
}

void SceneAssets::add_surface(const geometry::TriangleMesh& mesh, wire::Mesh& message) {
  try {
    const auto bytes = std::make_shared<const proto::Bytes>(geometry::surface_asset_bytes(mesh));
    const proto::Sha256 hash = proto::sha256_of(*bytes);
    message.set_surface_sha256(hash.data(), hash.size());
    if (!offer({hash, geometry::kSurfaceAssetKind, sized_name(message) + ".surface", bytes})) return;
    add_drawings(mesh, message, hash);
  } catch (const std::invalid_argument& error) {
    notes.push_back(message.file() + ": " + error.what() +
                    ", so clients can neither draw it nor touch it with a point");
  }
}

void SceneAssets::add_drawings(const geometry::TriangleMesh& mesh, const wire::Mesh& message,
                               const proto::Sha256& surface) {
  for (const geometry::ShadedMesh& level : geometry::drawing_levels(mesh)) {
    const auto bytes = std::make_shared<const proto::Bytes>(geometry::drawing_asset_bytes(level));
    const std::string name = sized_name(message) + "." + std::to_string(level.first.triangles.size()) + ".drawing";
    offer({proto::sha256_of(*bytes), geometry::kDrawingAssetKind, name, bytes, surface});
  }
}

void SceneAssets::add_user_note(const std::string& note) {
  notes.push_back(note);
  notes_for_users.push_back(note);
}

bool SceneAssets::offer(Asset asset) {
  // Drawings of two surfaces may have equal bytes, so `coarse_of` is compared in addition to the hash.
  const auto is_same = [&asset](const Asset& other) {
    return other.sha256 == asset.sha256 && other.coarse_of == asset.coarse_of;
  };
  if (std::any_of(assets.begin(), assets.end(), is_same)) return false;
  assets.push_back(std::move(asset));
  return true;
}

void SceneAssets::add_sources(const wire::Scene& scene) {
  for (const wire::Body& body : scene.bodies()) {
    for (const wire::Shape& shape : body.shapes()) {
      if (shape.has_molecule()) sources_.push_back(shape.molecule());
    }
  }
}

std::shared_ptr<const docking::Molecule> SceneAssets::load_centred_molecule(wire::MoleculeSource& message,
                                                                            const std::string& force_field_directory,
                                                                            const SceneField& field,
                                                                            Vec3& centre_angstrom) {
  const SceneField file_field = field.in("file");
  const auto source_of = [this](const wire::MoleculeSource& molecule) -> StructureSource {
    return {located(molecule.file()),
            {{molecule.chains().begin(), molecule.chains().end()}},
            hydrogens_of(molecule.hydrogens())};
  };
  const StructureSource source = source_of(message);
  std::vector<StructureSource> all;
  std::ranges::transform(sources_, std::back_inserter(all), source_of);
  const std::filesystem::path& file = source.file;
  read(file, "structure", file_field);
  StructureReport report;
  auto molecule = std::make_shared<docking::Molecule>();
  try {
    *molecule = load_molecule(file, source.selection, force_field_directory, source.hydrogens, &report, all);
  } catch (const docking::MoleculeError& error) {
    field.refuse(std::string("cannot be used: ") + error.what());
  }
  centre_angstrom = molecule->centre();
  message.set_hydrogens(report.hydrogens);
  message.set_file(file.filename().string());
  notes.push_back(message.file() + ": " + std::to_string(molecule->size()) + " atoms, force field " +
                  molecule->force_field);
  for (const std::string& note : molecule->notes) add_user_note(message.file() + ": " + note);
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
  // The name contains the chains, because a scene may use one file with several choices of chains.
  std::string name = message.file();
  for (const std::string& chain : message.chains()) name += "." + chain;
  offer({hash, "molecule", name + ".molecule", bytes});
}

}  // namespace tandem::server

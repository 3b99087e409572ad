#include "server/assets/contact_library.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <thread>
#include "proto/world_from_wire.hpp"

namespace tandem::server {
namespace {

/// Meshes larger than this get cells and spacings in proportion: the default ones would fill the memory.
constexpr double kFullResolutionSize_m = 0.2;
/// No asset is as large: what is larger is not one.
constexpr std::uintmax_t kMaxEntryBytes = 1U << 30U;

std::string hex(const proto::Sha256& hash) {
  std::ostringstream out;
  out << std::hex << std::setfill('0');
  for (const std::byte byte : hash) out << std::setw(2) << std::to_integer<int>(byte);
  return out.str();
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

template <typename T>
void append(proto::Bytes& bytes, const T& value) {
  const auto* const first = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(T));
}

/// Everything that the asset's bytes depend on. The cache is this machine's own, so its byte order will do.
proto::Sha256 key_of(const geometry::ContactMesh& mesh, double sheet_thickness_m) {
  proto::Bytes bytes;
  bytes.reserve(32 + mesh.mesh.vertices.size() * sizeof(Vec3) + mesh.mesh.triangles.size() * sizeof(int) * 3);
  append(bytes, contact::kContactAssetVersion);
  append(bytes, sheet_thickness_m);
  append(bytes, static_cast<std::uint32_t>(mesh.kind));
  for (const Vec3& vertex : mesh.mesh.vertices) {
    for (int i = 0; i < 3; ++i) append(bytes, vertex[i]);
  }
  for (const auto& triangle : mesh.mesh.triangles) append(bytes, triangle);
  return proto::sha256_of(bytes);
}

/// An entry of the cache is the asset's key, which tells a renamed file from the right one, and the asset's bytes.
/// Empty for anything else: the cache is a folder that others can write to.
std::vector<std::uint8_t> read_entry(const std::filesystem::path& file, const proto::Sha256& key) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return {};
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size < key.size() || size > kMaxEntryBytes) return {};
  std::ifstream stream(file, std::ios::binary);
  proto::Sha256 found{};
  stream.read(reinterpret_cast<char*>(found.data()), static_cast<std::streamsize>(found.size()));
  if (!stream || found != key) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size) - key.size());
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) return {};
  return bytes;
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

}  // namespace

std::shared_ptr<const contact::ContactShape> ContactLibrary::primitive(const wire::Shape& shape) {
  std::array<double, 4> key{static_cast<double>(shape.kind_case())};
  if (shape.has_box()) std::copy_n(shape.box().size_m().begin(), 3, key.begin() + 1);
  if (shape.has_cylinder()) key = {key[0], shape.cylinder().radius_m(), shape.cylinder().length_m(), 0};
  if (shape.has_capsule()) key = {key[0], shape.capsule().radius_m(), shape.capsule().length_m(), 0};
  if (shape.has_sphere()) key[1] = shape.sphere().radius_m();
  std::shared_ptr<const contact::ContactShape>& entry = primitives_[key];
  if (!entry) entry = proto::primitive_contact(shape);
  return entry;
}

ContactAsset ContactLibrary::mesh(const geometry::ContactMesh& mesh, double sheet_thickness_m,
                                  const std::string& name) {
  const proto::Sha256 key = key_of(mesh, sheet_thickness_m);
  if (const auto found = meshes_.find(key); found != meshes_.end()) return found->second;
  const auto begin = std::chrono::steady_clock::now();
  const std::filesystem::path cached =
      loading_.cache_directory.empty() ? "" : loading_.cache_directory / (hex(key) + ".contact");

  ContactAsset asset;
  std::vector<std::uint8_t> bytes = cached.empty() ? std::vector<std::uint8_t>{} : read_entry(cached, key);
  if (!bytes.empty()) asset.shape = contact::contact_shape_from(bytes);
  if (asset.shape) {
    asset.note = describe(*asset.shape, "from cache", seconds_since(begin));
  } else {
    const auto progress = [&](double done) {
      if (loading_.progress) loading_.progress("building contact of " + name, done);
    };
    asset.shape = contact::make_contact_mesh(mesh, options_for(mesh, sheet_thickness_m), progress);
    asset.note = describe(*asset.shape, "built", seconds_since(begin));
    bytes = contact::contact_asset_bytes(*asset.shape);
    if (!cached.empty() && !write_whole_file(cached, {key, std::as_bytes(std::span(bytes))})) {
      asset.note += "; " + cached.string() + " cannot be written, so the next start builds it again";
    }
  }
  const auto* const first = reinterpret_cast<const std::byte*>(bytes.data());
  asset.bytes = std::make_shared<const proto::Bytes>(first, first + bytes.size());
  asset.sha256 = proto::sha256_of(*asset.bytes);
  meshes_.emplace(key, asset);
  return asset;
}

}  // namespace tandem::server

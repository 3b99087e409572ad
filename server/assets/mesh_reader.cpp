// The program tandem-mesh-reader, which parses one mesh file in bounded memory and time (see mesh_reader.hpp).
#include "server/assets/mesh_reader.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/byte_io.hpp"
#include "server/assets/meshes/collada_shift.hpp"
#include "server/assets/meshes/formats.hpp"
#include "server/assets/meshes/gltf_checks.hpp"
#include "server/assets/meshes/text.hpp"
#include "server/assets/meshes/triangles.hpp"

#if defined(__SANITIZE_ADDRESS__)
// AddressSanitizer needs an unlimited address space, so RLIMIT_AS cannot be used. Instead, the size of a single
// allocation and the resident memory are limited.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=3000:hard_rss_limit_mb=4000:detect_leaks=0";
}
#endif

namespace {

using namespace tandem;
using namespace tandem::server::mesh_reader;
using Bytes = std::vector<std::uint8_t>;

constexpr int kBadCall = 2;

void limit(__rlimit_resource resource, std::size_t value) {
  const rlimit both{value, value};
  setrlimit(resource, &both);
}

/// Limits memory, time and files of this process. It is called after the program's libraries are loaded, because the
///        process cannot open any file from then on.
void limit_resources(std::size_t file_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  limit(RLIMIT_AS, address_space_limit(file_bytes));
#endif
  limit(RLIMIT_CPU, cpu_limit_s(file_bytes));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, 3);
  std::set_new_handler([] { _exit(kOutOfMemory); });
}

/// Maps the whole standard input into memory. Returns an empty span if there is no input.
std::span<const std::byte> input() {
  struct stat status {};
  if (fstat(STDIN_FILENO, &status) != 0 || status.st_size <= 0) return {};
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, STDIN_FILENO, 0);
  if (bytes == MAP_FAILED) return {};
  return {static_cast<const std::byte*>(bytes), size};
}

Bytes refusal(std::string text) {
  if (text.size() > kMaxRefusalBytes) text.resize(kMaxRefusalBytes);
  Bytes reply{kRefusal};
  reply.insert(reply.end(), text.begin(), text.end());
  return reply;
}

Bytes reply_of(const geometry::TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return refusal("which has no triangle; export its surface as triangles");
  if (mesh.triangles.size() > kMaxTriangles || mesh.vertices.size() > kMaxVertices) {
    return refusal("which has " + std::to_string(mesh.triangles.size()) + " triangles; at most " +
                   std::to_string(kMaxTriangles) + " are possible");
  }
  Bytes reply{kMesh};
  reply.reserve(9 + mesh.vertices.size() * 24 + mesh.triangles.size() * 12);
  ByteWriter writer(reply);
  writer.u32(static_cast<std::uint32_t>(mesh.vertices.size()));
  writer.u32(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Vec3& vertex : mesh.vertices) writer.array(std::span<const double>(vertex.data(), 3));
  for (const auto& triangle : mesh.triangles) writer.array(std::span<const std::int32_t>(triangle));
  return reply;
}

std::vector<GivenFile> files_of(std::span<const std::byte> input) {
  std::vector<GivenFile> files;
  auto rest = octets_of(input);
  while (!rest.empty()) {
    ByteReader reader(rest);
    const std::size_t name = reader.u32(), size = reader.u32();
    if (!reader.ok() || name > rest.size() || size > rest.size() - name) return {};
    files.push_back({std::string(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(name)),
                     std::as_bytes(rest.subspan(name, size))});
    rest = rest.subspan(name + size);
  }
  return files;
}

/// Removes the UTF-8 byte order mark that some editors write at the start.
std::span<const std::byte> without_mark(std::span<const std::byte> bytes) {
  return bytes.subspan(text_of(bytes).starts_with("\xEF\xBB\xBF") ? 3 : 0);
}

/// Returns whether the vertices of an .obj can be used as Assimp reads them, in single precision, because they are
/// exact enough. They are then used unchanged, because the keys of cached contact shapes depend on their bits.
bool is_ordinary(const Extent& extent) {
  constexpr double kMinSize = 1e-2, kMaxSize = 1e6, kFarthest = 4;
  return extent.size >= kMinSize && extent.size <= kMaxSize && extent.farthest <= kFarthest * extent.size;
}

/// Returns whether the vertices that Assimp has read have the same bounding box as those in the file.
bool is_same_box(const Extent& extent, const geometry::TriangleMesh& mesh) {
  constexpr double kMaxShare = 1e-5;
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : mesh.vertices) box.extend(vertex);
  return !box.isEmpty() && std::abs(box.sizes().maxCoeff() - extent.size) <= kMaxShare * extent.size &&
         (box.center() - extent.middle).cwiseAbs().maxCoeff() <= kMaxShare * extent.size;
}

geometry::TriangleMesh checked_triangles(const Polygons& mesh) {
  check(mesh);
  return triangulated(mesh);
}

geometry::TriangleMesh triangles_of_obj(const std::vector<GivenFile>& files) {
  const Polygons mesh = polygons_of_obj(text_of(without_mark(files.front().bytes)));
  check(mesh);
  const Extent extent = extent_of(mesh);
  if (is_ordinary(extent)) {
    std::optional<geometry::TriangleMesh> triangles = assimp_triangles(files, mesh.face_sizes.size());
    if (triangles && is_same_box(extent, *triangles)) return *std::move(triangles);
  }
  return triangulated(mesh);
}

geometry::TriangleMesh triangles_of_dae(std::vector<GivenFile> files) {
  const std::optional<ShiftedCollada> shifted = shifted_collada(text_of(files.front().bytes));
  if (!shifted) return checked_triangles(polygons_of_scene(files, std::nullopt));
  files.front().bytes = std::as_bytes(std::span(shifted->text));
  return checked_triangles(polygons_of_scene(files, std::nullopt, shifted->shift));
}

geometry::TriangleMesh triangles_of(const std::vector<GivenFile>& files, const std::string& format) {
  const std::span<const std::byte> bytes = without_mark(files.front().bytes);
  if (format == "obj") return triangles_of_obj(files);
  if (format == "off") return checked_triangles(polygons_of_off(text_of(bytes)));
  if (format == "ply") return checked_triangles(polygons_of_ply(bytes));
  if (format == "stl") return checked_triangles(polygons_of_stl(bytes));
  if (format == "gltf" || format == "glb") {
    return checked_triangles(polygons_of_scene(files, checked_gltf_triangles(bytes)));
  }
  if (format == "dae") return triangles_of_dae(files);
  if (format == "3ds") return checked_triangles(polygons_of_scene(files, std::nullopt));
  throw Refusal("which is in a format that is not read; give .obj, .stl, .ply, .off, .gltf, .glb, .3ds or .dae");
}

Bytes import(std::span<const std::byte> bytes, const std::string& format) {
  std::vector<GivenFile> files = files_of(bytes);
  if (files.empty()) return refusal("which is empty; export the mesh again");
  files.front().name = "mesh." + format;
  try {
    return reply_of(triangles_of(files, format));
  } catch (const Refusal& why) {
    return refusal(why.what());
  }
}

bool write_all(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

constexpr const char* kHelp =
    "Reads one mesh file in bounded memory and time. tandem-server and tandem-lab start it.\n"
    "Usage: tandem-mesh-reader FORMAT\n\n"
    "Positionals:\n"
    "  FORMAT TEXT REQUIRED        format of the file: obj, stl, ply, off, gltf, glb, 3ds or dae\n\n"
    "Options:\n"
    "  --help                      Print this help message and exit\n\n"
    "The file is read from stdin, and its triangles are written to stdout, both in a private format.\n"
    "Exit code: 0 done, 2 called in another way, 3 out of memory.\n";

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && argv[1] == std::string_view("--help")) {
    return std::fputs(kHelp, stdout) >= 0 && std::fflush(stdout) == 0 ? 0 : kBadCall;
  }
  const std::span<const std::byte> bytes = input();
  if (argc != 2 || bytes.empty()) return kBadCall;
  limit_resources(bytes.size());
  const bool is_written = write_all(import(bytes, lower_case(argv[1])));
  // The importer's destructor is skipped, because the system frees the memory of a process faster.
  _exit(is_written ? 0 : kBadCall);
}

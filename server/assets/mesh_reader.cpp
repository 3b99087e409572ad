// tandem-mesh-reader: parses one mesh file in bounded memory and time, for mesh_file.cpp. See mesh_reader.hpp.
#include "server/assets/mesh_reader.hpp"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <assimp/DefaultLogger.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <cerrno>
#include <new>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/byte_io.hpp"

#if defined(__SANITIZE_ADDRESS__)
// An address space cannot be limited under it; single allocations can.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=3000:hard_rss_limit_mb=4000:detect_leaks=0";
}
#endif

namespace {

using namespace tandem;
using namespace tandem::server::mesh_reader;
using Bytes = std::vector<std::uint8_t>;

constexpr int kBadCall = 2;
constexpr std::size_t kMaxPlyHeader = 65536;

void limit(__rlimit_resource resource, std::size_t value) {
  const rlimit both{value, value};
  setrlimit(resource, &both);
}

/// After the program's libraries are loaded: from now on it can open nothing, whatever the file names.
void limit_resources(std::size_t file_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  limit(RLIMIT_AS, address_space_limit(file_bytes));
#endif
  limit(RLIMIT_CPU, cpu_limit_s(file_bytes));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, 3);
  std::set_new_handler([] { _exit(kOutOfMemory); });
}

/// The whole of the standard input; empty for none.
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

std::size_t triangles_of(const aiMesh& part) {
  std::size_t count = 0;
  for (unsigned f = 0; f < part.mNumFaces; ++f) count += part.mFaces[f].mNumIndices == 3 ? 1 : 0;
  return count;
}

void write_vertices(const aiScene& scene, ByteWriter& writer) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      writer.f64(part.mVertices[v].x);
      writer.f64(part.mVertices[v].y);
      writer.f64(part.mVertices[v].z);
    }
  }
}

void write_triangles(const aiScene& scene, ByteWriter& writer) {
  std::int32_t first = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (unsigned corner = 0; corner < 3; ++corner) {
        writer.number(first + static_cast<std::int32_t>(face.mIndices[corner]));
      }
    }
    first += static_cast<std::int32_t>(part.mNumVertices);
  }
}

/// Assimp's triangles of all its meshes in one list, in file units.
Bytes reply_of(const aiScene& scene) {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    vertices += scene.mMeshes[m]->mNumVertices;
    triangles += triangles_of(*scene.mMeshes[m]);
  }
  if (triangles > kMaxTriangles || vertices > kMaxVertices) {
    return refusal("which has " + std::to_string(triangles) + " triangles; at most " + std::to_string(kMaxTriangles) +
                   " are possible");
  }
  Bytes reply{kMesh};
  reply.reserve(9 + vertices * 24 + triangles * 12);
  ByteWriter writer(reply);
  writer.u32(static_cast<std::uint32_t>(vertices));
  writer.u32(static_cast<std::uint32_t>(triangles));
  write_vertices(scene, writer);
  write_triangles(scene, writer);
  return reply;
}

/// A file that was given, or its name alone.
struct GivenFile {
  std::string name;
  std::span<const std::byte> bytes;
};

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

/// What Assimp may open: the files that were given.
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

/// Assimp leaves out a newline behind the header of a binary PLY, even where it is the first byte of a coordinate: that one is
/// put there twice. Empty: nothing has to be done.
std::vector<std::byte> ply_with_newline(std::span<const std::byte> bytes) {
  constexpr std::string_view kEnd = "end_header\n";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t end = text.substr(0, kMaxPlyHeader).find(kEnd);
  if (end == std::string_view::npos || text.substr(0, end).find("\nformat binary_") == std::string_view::npos)
    return {};
  const std::size_t data = end + kEnd.size();
  if (data >= text.size() || text[data] != '\n') return {};
  std::vector<std::byte> doubled(bytes.begin(), bytes.end());
  doubled.insert(doubled.begin() + static_cast<std::ptrdiff_t>(data), std::byte{'\n'});
  return doubled;
}

/// Assimp takes the last vertex for one that is not there, or leaves the face out, and only writes so into its log.
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
    const auto is_said = [text](const char* words) { return text.find(words) != std::string_view::npos; };
    // Of .off, .3ds and .gltf; readers of other formats throw.
    constexpr std::array kWrongIndex{"Vertex index is out of range", "Vertex index overflow", "out-of-range indices"};
    is_index_wrong |= std::ranges::any_of(kWrongIndex, is_said);
  }

  bool is_index_wrong = false;

 private:
  static constexpr unsigned kSeverity = Assimp::Logger::Err | Assimp::Logger::Warn;
};

/// Why Assimp gives no mesh, in its own words in brackets.
Bytes refusal_of(const std::string& reason, const std::string& format) {
  constexpr std::array kWithoutTriangle{"No meshes remaining", "all meshes are orphaned", "OBJ-file is too small",
                                        "There are no valid faces", "no data loaded"};
  const std::string in_brackets = reason.empty() ? "" : " (" + reason + ")";
  const auto is_said = [&reason](const char* words) { return reason.find(words) != std::string::npos; };
  if (std::ranges::any_of(kWithoutTriangle, is_said)) {
    return refusal("which has no triangle" + in_brackets + "; export its surface as triangles");
  }
  const bool is_known = Assimp::Importer().IsExtensionSupported("." + format);
  const bool is_other = is_said("Failed to determine") || is_said("No suitable reader");
  return refusal("which is not a mesh that can be read" + in_brackets +
                 (!is_known  ? "; give a file such as .obj, .ply or .stl"
                  : is_other ? "; export the mesh again, in the format that its name says"
                             : "; export the mesh again"));
}

/// Positions only, so that corners that differ in colour or normal join; nodes flattened into one frame.
Bytes import(std::span<const std::byte> bytes, const std::string& format) {
  std::vector<GivenFile> files = files_of(bytes);
  if (files.empty()) return refusal("which is empty; export the mesh again");
  Complaints complaints;
  const std::string name = "mesh." + format;
  files.front().name = name;
  const std::vector<std::byte> ply = format == "ply" ? ply_with_newline(files.front().bytes) : std::vector<std::byte>{};
  if (!ply.empty()) files.front().bytes = ply;
  Assimp::Importer importer;
  importer.SetIOHandler(new GivenFiles(std::move(files)));
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                                          aiComponent_TEXTURES | aiComponent_LIGHTS |
                                                          aiComponent_CAMERAS | aiComponent_MATERIALS);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* const scene =
      importer.ReadFile(name, aiProcess_RemoveComponent | aiProcess_PreTransformVertices | aiProcess_Triangulate |
                                  aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  if (complaints.is_index_wrong) {
    return refusal("which has a face with an index beyond its last vertex; export the mesh again");
  }
  if (scene != nullptr && scene->mNumMeshes > 0) return reply_of(*scene);
  return refusal_of(importer.GetErrorString(), format);
}

bool write_all(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<const std::byte> bytes = input();
  if (argc != 2 || bytes.empty()) return kBadCall;
  limit_resources(bytes.size());
  const bool is_written = write_all(import(bytes, argv[1]));
  // Not through the importer's end: what it holds is the system's to free.
  _exit(is_written ? 0 : kBadCall);
}

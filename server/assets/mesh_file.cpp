#include "server/assets/mesh_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/base/byte_io.hpp"
#include "common/base/folders.hpp"
#include "common/base/json.hpp"
#include "common/base/time.hpp"
#include "server/assets/mesh_reader.hpp"

namespace tandem::server {
namespace {

namespace fs = std::filesystem;

// Limit of wall-clock time, as a multiple of the limit of processor time, because other programs may use the processor
// as well.
constexpr int kMaxWaitShare = 10;
/// Limit of the number of additional files (buffers) of one mesh file.
constexpr std::size_t kMaxBeside = 64;
/// Largest .gltf in which the names of buffer files are looked up. A larger file is assumed to contain its buffers.
constexpr std::size_t kMaxDescription = std::size_t{4} << 20U;
/// Range of plausible sizes of objects that are touched by hand. Other sizes are allowed, but often mean that the scale
/// of the file is missing.
constexpr double kMinPlausible_m = 1e-3, kMaxPlausible_m = 3;

/// Returns the remedy for a missing file: the Debian package of its folder, or the text `otherwise` if there is none.
std::string remedy_for(const std::filesystem::path& file, const std::string& otherwise) {
  const std::string text = file.string();
  const auto is_below = [&text](const char* folder) { return text.rfind(folder, 0) == 0; };
  if (is_below("/usr/share/glmark2/")) return "install Debian package glmark2-data";
  if (is_below("/usr/share/pymol/")) return "install Debian package pymol-data";
  if (is_below("/usr/share/gromacs/")) return "install Debian package gromacs-data";
  return otherwise;
}

std::string mebibytes(std::size_t bytes) {
  return std::to_string(bytes >> 20U) + " MiB";
}

/// Returns the path of the reader program: $TANDEM_MESH_READER, otherwise in program_folder().
fs::path reader_program() {
  const char* const chosen = std::getenv("TANDEM_MESH_READER");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  return program_folder() / "tandem-mesh-reader";
}

/// Owns a file descriptor and closes it.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }

  int get() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw std::runtime_error(file.string() + ", " + why);
}

[[noreturn]] void refuse_without_reader(const fs::path& file, int error) {
  refuse(file, "which cannot be read, for " + reader_program().string() + " cannot be started (" +
                   std::strerror(error) + "); install it there, or set TANDEM_MESH_READER to where it is");
}

/// An additional file that is passed to the reader program, with the name by which the mesh file refers to it.
struct GivenFile {
  std::string name;
  std::vector<std::byte> bytes;
};

void write_all(int descriptor, std::span<const std::byte> bytes) {
  while (descriptor >= 0 && !bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
    if (written < 0 && errno != EINTR) return;
  }
}

void append(int descriptor, const std::string& name, std::span<const std::byte> bytes) {
  std::vector<std::uint8_t> head;
  ByteWriter writer(head);
  writer.u32(static_cast<std::uint32_t>(name.size()));
  writer.u32(static_cast<std::uint32_t>(bytes.size()));
  write_all(descriptor, std::as_bytes(std::span(head)));
  write_all(descriptor, std::as_bytes(std::span(name)));
  write_all(descriptor, bytes);
}

/// Returns the descriptor of an anonymous file with the mesh and its additional files. The reader maps it.
int memory_file(std::span<const std::byte> bytes, const std::vector<GivenFile>& beside) {
  const int descriptor = memfd_create("mesh", MFD_CLOEXEC);
  append(descriptor, "", bytes);
  for (const GivenFile& file : beside) append(descriptor, file.name, file.bytes);
  return descriptor;
}

/// Decodes percent escapes, e.g. "%20" to a space.
std::string unescaped(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    const bool is_code = uri[i] == '%' && i + 2 < uri.size() &&
                         std::from_chars(uri.data() + i + 1, uri.data() + i + 3, code, 16).ptr == uri.data() + i + 3;
    text += is_code ? static_cast<char>(code) : uri[i];
    i += is_code ? 2 : 0;
  }
  return text;
}

/// Returns the names of the buffer files of a .gltf, except those outside of its folder.
std::vector<std::string> buffers_of(std::span<const std::byte> gltf) {
  namespace json = boost::json;
  std::vector<std::string> names;
  if (gltf.size() > kMaxDescription) return names;
  boost::system::error_code error;
  const json::value document = json::parse({reinterpret_cast<const char*>(gltf.data()), gltf.size()}, error);
  const auto add = [&names](const json::value& buffer) {
    const json::value* const uri = buffer.is_object() ? buffer.as_object().if_contains("uri") : nullptr;
    if (uri == nullptr || !uri->is_string() || uri->as_string().starts_with("data:")) return;
    const std::string name = unescaped(std::string(uri->as_string()));
    const fs::path path = fs::path(name).lexically_normal();
    const bool is_beside = !path.empty() && path.is_relative() && *path.begin() != "..";
    if (is_beside && names.size() < kMaxBeside) names.push_back(name);
  };
  const json::value* const buffers =
      !error && document.is_object() ? document.as_object().if_contains("buffers") : nullptr;
  if (buffers != nullptr && buffers->is_array()) std::ranges::for_each(buffers->as_array(), add);
  // In version 1 of glTF, `buffers` is an object whose keys are names.
  if (buffers != nullptr && buffers->is_object()) {
    for (const auto& [key, buffer] : buffers->as_object()) add(buffer);
  }
  return names;
}

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

std::vector<GivenFile> files_beside(std::span<const std::byte> bytes, const fs::path& file) {
  std::vector<GivenFile> files;
  if (lower_extension(file) != ".gltf") return files;
  std::size_t total = bytes.size();
  for (const std::string& name : buffers_of(bytes)) {
    const fs::path path = file.parent_path() / name;
    std::error_code error;
    // A missing file is skipped here; the reader reports it.
    if (!fs::is_regular_file(path, error)) continue;
    std::vector<std::byte> buffer = read_asset_file(path, "");
    total += buffer.size();
    if (total > mesh_reader::kMaxFileBytes) {
      refuse(file,
             "which with its buffers is too large; at most " + mebibytes(mesh_reader::kMaxFileBytes) + " are possible");
    }
    files.push_back({name, std::move(buffer)});
  }
  return files;
}

std::size_t bytes_of(std::span<const std::byte> bytes, const std::vector<GivenFile>& beside) {
  std::size_t total = bytes.size();
  for (const GivenFile& file : beside) total += file.bytes.size();
  return total;
}

/// The running reader program. It can be started while other threads run, because the child process uses no memory of
/// this process between fork and exec.
class ReaderProcess {
 public:
  ReaderProcess(const std::vector<std::byte>& bytes, const std::vector<GivenFile>& beside, const fs::path& file)
      : file_(file), file_bytes_(bytes_of(bytes, beside)), input_(memory_file(bytes, beside)) {
    int ends[2] = {-1, -1};
    if (input_.get() < 0 || pipe2(ends, O_CLOEXEC) != 0) refuse_without_reader(file, errno);
    output_.emplace(ends[0]);
    const Descriptor writing(ends[1]);
    start(writing.get());
  }
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;
  ~ReaderProcess() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    wait();
  }

  /// Returns the reply. Refuses the file if the reader fails.
  std::vector<std::uint8_t> reply() {
    std::vector<std::uint8_t> reply;
    const SteadyClock clock;
    const LocalTime deadline =
        clock.now() + kMaxWaitShare * std::chrono::seconds(mesh_reader::cpu_limit_s(file_bytes_));
    while (read_more(reply)) {
      if (clock.now() >= deadline) refuse_slow();
      if (reply.size() > mesh_reader::kMaxReplyBytes) refuse(file_, "whose mesh is too large; reduce it");
    }
    check_end();
    return reply;
  }

 private:
  void start(int writing) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input_.get(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, writing, STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
    const std::string program = reader_program().string();
    const std::string extension = file_.extension().string();
    const std::string format = extension.empty() ? "" : extension.substr(1);
    char* const arguments[] = {const_cast<char*>("tandem-mesh-reader"), const_cast<char*>(format.c_str()), nullptr};
    const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error == 0) return;
    pid_ = -1;
    refuse_without_reader(file_, error);
  }

  /// Appends the next bytes of the reply, after a wait of at most 0.1 s. Returns false at the end of the reply.
  bool read_more(std::vector<std::uint8_t>& reply) const {
    pollfd ready{output_->get(), POLLIN, 0};
    if (poll(&ready, 1, 100) <= 0) return true;
    std::uint8_t piece[65536];
    const ssize_t count = ::read(output_->get(), piece, sizeof piece);
    if (count > 0) reply.insert(reply.end(), piece, piece + count);
    return count > 0 || (count < 0 && errno == EINTR);
  }

  int wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

  void check_end() {
    const int status = wait();
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
    if (WIFEXITED(status) && WEXITSTATUS(status) == mesh_reader::kOutOfMemory) {
      refuse(file_, "which needs more than " + mebibytes(mesh_reader::address_space_limit(file_bytes_)) +
                        " to be read, far more than its size: it declares more than it holds; export the mesh again");
    }
    if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL)) refuse_slow();
    refuse(file_, "which is so damaged that its reader fails (" +
                      (WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                           : "exit code " + std::to_string(WEXITSTATUS(status))) +
                      "); export the mesh again");
  }

  [[noreturn]] void refuse_slow() const {
    refuse(file_, "which takes more than " + std::to_string(mesh_reader::cpu_limit_s(file_bytes_)) +
                      " s to be read; export the mesh again, e.g. as binary .stl or .ply");
  }

  const fs::path& file_;
  std::size_t file_bytes_;
  Descriptor input_;
  std::optional<Descriptor> output_;
  pid_t pid_ = -1;
};

/// Decodes the reply of the reader. Returns a mesh only if the reply is exactly a mesh of bounded size whose indices
/// are in range. The reply is checked because a hostile file may have compromised the reader.
std::optional<geometry::TriangleMesh> mesh_of_reply(std::span<const std::uint8_t> reply) {
  ByteReader reader(reply);
  const std::uint8_t kind = reader.number<std::uint8_t>();
  const std::size_t vertices = reader.u32();
  const std::size_t triangles = reader.u32();
  const bool is_bounded = vertices <= mesh_reader::kMaxVertices && triangles <= mesh_reader::kMaxTriangles;
  if (!reader.ok() || kind != mesh_reader::kMesh || !is_bounded || reply.size() != vertices * 24 + triangles * 12) {
    return std::nullopt;
  }
  geometry::TriangleMesh mesh;
  mesh.vertices.resize(vertices);
  for (Vec3& vertex : mesh.vertices) reader.array(std::span<double>(vertex.data(), 3));
  mesh.triangles.resize(triangles);
  bool is_in_range = true;
  for (auto& triangle : mesh.triangles) {
    reader.array(std::span<int>(triangle));
    for (const int corner : triangle) is_in_range &= corner >= 0 && static_cast<std::size_t>(corner) < vertices;
  }
  if (!is_in_range) return std::nullopt;
  return mesh;
}

/// Replaces the name that the reader program uses in its messages, mesh.FORMAT, by the real name of the file.
std::string named_as(const fs::path& file, std::string text) {
  const std::string extension = file.extension().string();
  const std::string name = "mesh." + (extension.empty() ? "" : extension.substr(1));
  const std::size_t at = text.find(name);
  if (at != std::string::npos) text.replace(at, name.size(), file.filename().string());
  return text;
}

geometry::TriangleMesh import_mesh(const std::vector<std::byte>& bytes, const fs::path& file) {
  if (bytes.empty()) refuse(file, "which is empty; export the mesh again");
  const std::vector<std::uint8_t> reply = ReaderProcess(bytes, files_beside(bytes, file), file).reply();
  if (!reply.empty() && reply.front() == mesh_reader::kRefusal) {
    const std::size_t size = std::min(reply.size(), mesh_reader::kMaxRefusalBytes + 1);
    std::string text(reply.begin() + 1, reply.begin() + static_cast<std::ptrdiff_t>(size));
    for (char& c : text) c = c < ' ' || c > '~' ? '?' : c;
    refuse(file, named_as(file, text));
  }
  std::optional<geometry::TriangleMesh> mesh = mesh_of_reply(reply);
  if (!mesh) refuse(file, "which is so damaged that its reader fails; export the mesh again");
  return std::move(*mesh);
}

void check(const geometry::TriangleMesh& mesh, const fs::path& file) {
  for (const Vec3& vertex : mesh.vertices) {
    if (!is_finite(vertex)) refuse(file, "which has a vertex that is not finite; repair the mesh");
  }
}

}  // namespace

std::vector<std::byte> read_asset_file(const std::filesystem::path& file, const std::string& remedy) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) refuse(file, "which is a folder; give a file in it");
  if (!std::filesystem::is_regular_file(file, error)) {
    throw std::runtime_error(file.string() + ", which does not exist; " + remedy_for(file, remedy));
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > mesh_reader::kMaxFileBytes) {
    throw std::runtime_error(file.string() + ", which is too large; at most " +
                             std::to_string(mesh_reader::kMaxFileBytes >> 20U) + " MiB are possible");
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

bool states_unit(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".gltf" || extension == ".glb" || extension == ".dae";
}

bool states_up_axis(const std::filesystem::path& file) {
  return states_unit(file) || lower_extension(file) == ".3ds";
}

bool is_too_large(double size_m) {
  return size_m > kMaxPlausible_m;
}

std::string doubt_of_size(double size_m, double scale_m, const std::filesystem::path& file) {
  if (size_m >= kMinPlausible_m && !is_too_large(size_m)) return "";
  std::ostringstream text;
  text << size_m << " m large, ";
  if (states_unit(file) && scale_m == 1) {
    text << "by the unit that the file states";
  } else {
    text << "if a unit of the file is " << scale_m << " m";
  }
  text << ": is that right?";
  return text.str();
}

geometry::TriangleMesh read_mesh_file(const std::filesystem::path& file, const std::string& remedy) {
  return mesh_of_bytes(read_asset_file(file, remedy), file);
}

}  // namespace tandem::server

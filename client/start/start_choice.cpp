#include "client/start/start_choice.hpp"

#include <algorithm>
#include <boost/json.hpp>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <span>
#include <stdexcept>
#include <system_error>

#include "client/start/shipped_scenes.hpp"
#include "common/net/host_port.hpp"
#include "common/net/text.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;
namespace json = boost::json;

constexpr std::array<std::string_view, 8> kMeshEndings{".stl", ".obj", ".ply", ".off", ".gltf", ".glb", ".3ds", ".dae"};
constexpr std::array<std::string_view, 6> kStructureEndings{".pdb", ".ent", ".cif", ".mmcif", ".pqr", ".pdbqt"};
/// Mesh formats that define the vertical axis, so that the user need not choose it. The server applies the axis of the
/// format.
constexpr std::array<std::string_view, 3> kOrientedEndings{".gltf", ".glb", ".dae"};
constexpr double kToolAbove_m = 0.02;

std::string ending_of(fs::path file) {
  if (file.extension() == ".gz") file.replace_extension();
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

bool is_in(std::span<const std::string_view> endings, const fs::path& file) {
  return std::ranges::find(endings, ending_of(file)) != endings.end();
}

/// Replaces each "%XX" by the byte with this hexadecimal code, except "%00", because no path contains a zero byte.
std::string decoded(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    unsigned char code = 0;
    const char* const end = text.data() + std::min<std::size_t>(text.size(), 3);
    const bool is_code = text.front() == '%' && end == text.data() + 3 &&
                         std::from_chars(text.data() + 1, end, code, 16).ptr == end && code != 0;
    plain += is_code ? static_cast<char>(code) : text.front();
    text.remove_prefix(is_code ? 3 : 1);
  }
  return plain;
}

/// Removes blanks, line ends and quotes around a pasted path or text. Converts a file URI ("file://HOST/PATH", as file
/// managers copy it) to its path.
std::string trimmed(std::string_view text) {
  constexpr std::string_view kAround = " \t\r\n'\"";
  const std::size_t begin = std::min(text.find_first_not_of(kAround), text.size());
  text.remove_prefix(begin);
  text = text.substr(0, std::min(text.find_last_not_of(kAround) + 1, text.size()));
  constexpr std::string_view kScheme = "file://";
  if (!text.starts_with(kScheme)) return std::string(text);
  text.remove_prefix(kScheme.size());
  return decoded(text.substr(std::min(text.find('/'), text.size())));
}

fs::path path_of(std::string_view text) {
  const std::string plain = trimmed(text);
  const char* const home = std::getenv("HOME");
  if (home != nullptr && plain.starts_with("~/")) return fs::path(home) / plain.substr(2);
  return plain;
}

/// Returns the file in a text "FILE:CHAINS". If a file with the name of the whole text exists, this is the file;
/// otherwise it is the text before the last colon.
fs::path structure_file(const std::string& text) {
  const fs::path whole = path_of(text);
  std::error_code error;
  if (fs::exists(whole, error)) return whole;
  const std::size_t colon = whole.string().rfind(':');
  return colon == std::string::npos ? whole : fs::path(whole.string().substr(0, colon));
}

std::string problem_of_file(const fs::path& file, const std::string& what) {
  if (file.empty()) return "type the path of " + what + ", or drop the file onto this window";
  std::error_code error;
  if (fs::is_directory(file, error)) return file.string() + " is a folder; choose " + what + " in it";
  if (!std::ifstream(file)) return file.string() + " cannot be read; check the path of " + what;
  return "";
}

std::string problem_of_structure(const std::string& text, const std::string& what) {
  const fs::path file = structure_file(text);
  if (std::string problem = problem_of_file(file, what); !problem.empty()) return problem;
  if (is_in(kStructureEndings, file)) return "";
  return file.filename().string() + " is no structure file; give .pdb, .cif, .pqr or .pdbqt";
}

std::string problem_of_mesh(const std::string& text) {
  const fs::path file = path_of(text);
  if (std::string problem = problem_of_file(file, "a mesh file"); !problem.empty()) return problem;
  std::error_code error;
  // The path becomes part of a scene file, which is JSON and therefore UTF-8.
  if (!is_utf8(fs::absolute(file, error).string())) {
    return "the path of the mesh file is not UTF-8; rename the file or its folder";
  }
  if (is_in(kMeshEndings, file)) return "";
  return file.filename().string() + " is no mesh file; give .stl, .obj, .ply, .off, .gltf, .glb, .3ds or .dae";
}

std::string problem_of_address(const std::string& text) {
  try {
    join_target(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

std::string absolute_structure(const std::string& text) {
  const std::string whole = path_of(text).string(), file = structure_file(text).string();
  std::error_code error;
  return fs::absolute(file, error).string() + whole.substr(file.size());
}

std::string file_name(const std::string& text) {
  return structure_file(text).filename().string();
}

bool is_this_machine(const std::string& host) {
  const auto address = net::numeric(host);
  return host == "localhost" || (address && address->is_loopback());
}

}  // namespace

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    if (!net::pop_code_point(text)) return false;
  }
  return true;
}

std::string title_of(const StartChoice& choice) {
  switch (choice.kind) {
    case StartChoice::Kind::kMesh:
      return file_name(choice.mesh);
    case StartChoice::Kind::kDock:
      return file_name(choice.receptor) + " and " + file_name(choice.ligand);
    case StartChoice::Kind::kJoin:
      return trimmed(choice.address);
    case StartChoice::Kind::kScene:
      break;
  }
  const ShippedScene* const shipped = find_shipped_scene(choice.scene);
  return shipped != nullptr ? std::string(shipped->title) : file_name(choice.scene);
}

std::string problem_of(const StartChoice& choice) {
  switch (choice.kind) {
    case StartChoice::Kind::kMesh:
      return problem_of_mesh(choice.mesh);
    case StartChoice::Kind::kDock: {
      const std::string problem = problem_of_structure(choice.receptor, "the first structure file");
      return problem.empty() ? problem_of_structure(choice.ligand, "the second structure file") : problem;
    }
    case StartChoice::Kind::kJoin:
      return problem_of_address(choice.address);
    case StartChoice::Kind::kScene:
      break;
  }
  if (find_shipped_scene(choice.scene) != nullptr) return "";
  return problem_of_file(path_of(choice.scene), "a scene file");
}

std::optional<StartChoice> with_file(StartChoice choice, const fs::path& file) {
  if (ending_of(file) == ".json") {
    choice.kind = StartChoice::Kind::kScene;
    choice.scene = file.string();
  } else if (is_in(kMeshEndings, file)) {
    choice.kind = StartChoice::Kind::kMesh;
    choice.mesh = file.string();
  } else if (is_in(kStructureEndings, file)) {
    choice.kind = StartChoice::Kind::kDock;
    const bool is_first = choice.receptor.empty() || !choice.ligand.empty();
    if (is_first) choice.ligand.clear();
    (is_first ? choice.receptor : choice.ligand) = file.string();
  } else {
    return std::nullopt;
  }
  return choice;
}

std::string mesh_scene(const StartChoice& choice) {
  const fs::path file = path_of(choice.mesh);
  std::error_code error;
  const json::object mesh{
      {"file", fs::absolute(file, error).string()}, {"largest_size_m", choice.mesh_size_m}, {"centre", true}};
  json::object body{{"name", "part"},
                    {"shapes", json::array{json::object{{"mesh", mesh}}}},
                    {"color_rgb", json::array{0.85, 0.82, 0.74}}};
  if (choice.is_y_up && !is_in(kOrientedEndings, file)) {
    body["placement"] = json::object{{"rotation_xyz_deg", json::array{90, 0, 0}}};
  }
  if (choice.is_movable) {
    body["mass_kg"] = 0.2;
    body["graspable"] = true;
    body["linear_damping_per_s"] = 2;
    body["angular_damping_per_s"] = 2;
  }
  const auto tool = [&choice](const char* name, double side) {
    const json::object placement{
        {"position_m", json::array{side * choice.mesh_size_m / 4, 0, choice.mesh_size_m / 2 + kToolAbove_m}}};
    return json::object{{"name", name}, {"placement", placement}};
  };
  const json::object scene{{"name", "mesh"},
                           {"bodies", json::array{body}},
                           {"tools", json::array{tool("hand", 0), tool("second", 1)}},
                           {"gravity_m_per_s2", json::array{0, 0, 0}}};
  return json::serialize(scene) + "\n";
}

std::string_view partner_of(const StartChoice& choice) {
  if (choice.kind != StartChoice::Kind::kScene || choice.is_hosted) return {};
  const ShippedScene* const scene = find_shipped_scene(choice.scene);
  return scene == nullptr ? std::string_view{} : scene->partner;
}

std::vector<std::string> server_arguments(const StartChoice& choice, const fs::path& scene_file) {
  std::vector<std::string> arguments;
  switch (choice.kind) {
    case StartChoice::Kind::kMesh:
      arguments = {"--scene", scene_file.string()};
      break;
    case StartChoice::Kind::kDock:
      arguments = {"--receptor", absolute_structure(choice.receptor), "--ligand", absolute_structure(choice.ligand)};
      break;
    default:
      arguments = {"--scene",
                   find_shipped_scene(choice.scene) != nullptr ? choice.scene : path_of(choice.scene).string()};
  }
  std::vector<std::string> how{"--insecure", "--bind", "127.0.0.1", "--port", "0"};
  if (choice.is_hosted) {
    // One invitation more than requested is needed, because this program joins its own server by an invitation too.
    how = {"--bind", "0.0.0.0", "--port", std::to_string(choice.port), "--invite", std::to_string(choice.invited + 1)};
  }
  if (!partner_of(choice).empty()) how.insert(how.end(), {"--begin-with", "2", "--countdown", "2s"});
  arguments.insert(arguments.end(), how.begin(), how.end());
  return arguments;
}

JoinTarget join_target(std::string_view pasted) {
  std::string text = trimmed(pasted);
  // The pasted text may be a whole line, e.g. of the server's output or of a chat message. In such a line, the
  // invitation follows "--join".
  if (const std::size_t option = text.rfind("--join "); option != std::string::npos)
    text = trimmed(text.substr(option + 7));
  if (text.empty()) throw std::invalid_argument("paste the invitation that the host has sent to you");
  if (auto invitation = proto::invitation_of(text)) {
    std::string server = invitation->server;
    return {std::move(invitation), std::move(server)};
  }
  if (text.find('/') != std::string::npos) {
    throw std::invalid_argument("this is no whole invitation; copy all of it, from the address to the last letter");
  }
  const net::HostPort host = net::host_port_of(text);
  if (!is_this_machine(host.host)) {
    throw std::invalid_argument("an address alone does not identify a server; ask its host for an invitation");
  }
  return {std::nullopt, text};
}

}  // namespace tandem::client

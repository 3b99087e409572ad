// A user's choice on the start screen: a scene, files or a server, and the server options that the choice needs.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/join_token.hpp"

namespace tandem::client {

struct StartChoice {
  enum class Kind { kScene, kMesh, kDock, kJoin };
  static constexpr std::array kKindNames{"scene", "mesh", "dock", "join"};

  Kind kind = Kind::kScene;
  std::string scene = "crate";       ///< name of a shipped scene, or a scene file
  std::string mesh{};                ///< path of the mesh file
  double mesh_size_m = 0.1;          ///< longest edge of the mesh's bounding box in the scene, 0.01 to 1 [m]
  bool is_y_up = false;              ///< true: the file's y axis points up; false: its z axis
  bool is_movable = false;           ///< true: the mesh can be lifted; false: it is fixed
  std::string receptor{}, ligand{};  ///< structure files, optionally with chains: FILE or FILE:CHAINS
  std::string address{};             ///< pasted invitation or address
  bool is_hosted = false;            ///< true: others may join by invitation; false: only this program
  int invited = 1;                   ///< number of invitations for others, 1 to 15
  int port = 47800;                  ///< port of a hosted server, 0 to 65535; 0: any free port

  bool operator==(const StartChoice&) const = default;
};

inline constexpr double kMinMeshSize_m = 0.01, kMaxMeshSize_m = 1;
inline constexpr int kMaxInvited = 15;

/// Returns whether a text is valid UTF-8, which scene files and stored choices require.
bool is_utf8(std::string_view text);

/// Returns a title for the user, e.g. "A crate for two" or "part.stl".
std::string title_of(const StartChoice& choice);

/// Returns the reason why the choice cannot be opened, with the remedy; empty if it can be opened. Possible reasons: a
/// file is missing, unreadable or of an unsupported format, or the pasted text is no invitation.
std::string problem_of(const StartChoice& choice);

/// Returns `choice` with a file that the user has dropped or typed: a scene, a mesh, or the next of two structures.
/// Out     the changed choice; nothing if the file's extension is not that of a supported format
std::optional<StartChoice> with_file(StartChoice choice, const std::filesystem::path& file);

/// Returns the scene file for a mesh: the mesh, and a tool 2 cm above it.
std::string mesh_scene(const StartChoice& choice);

/// Returns the hand path of the simulated partner in a shipped scene that is not hosted; empty: no partner.
std::string_view partner_of(const StartChoice& choice);

/// Returns the options of tandem-server for a choice. In a scene with a simulated partner, one option makes the server
/// start the hands of user and partner at a common time.
/// In      scene_file  file with the text of mesh_scene(); used only for a mesh
std::vector<std::string> server_arguments(const StartChoice& choice, const std::filesystem::path& scene_file);

/// Server to join, from an invitation or an address that the user has pasted.
struct JoinTarget {
  std::optional<proto::Invitation> invitation;  ///< empty: an address on this machine, joined without encryption
  std::string address;                          ///< address of the server, ADDRESS:PORT
};
/// Parses an invitation, a whole line that contains one, or an address of this machine.
/// Fails   std::invalid_argument: the text is neither; the message names the remedy
JoinTarget join_target(std::string_view pasted);

}  // namespace tandem::client

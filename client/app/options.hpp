// Command line of tandem-client. All options are checked before any file, device or socket is opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/haptics/stages/stage.hpp"
#include "client/net/client_io.hpp"
#include "common/recording/recording_file.hpp"
#include "devices/registry.hpp"

namespace tandem::client {

/// Settings of the window and of its screenshot.
struct WindowOptions {
  bool is_open = true;               ///< true unless --headless is given
  bool has_start_screen = false;     ///< true if no server is named: the user chooses a scene or a server in the window
  bool is_scene_only = false;        ///< true: the screenshot shows the scene without panels and texts
  bool begins_guide = false;         ///< true: shows the guided first minute
  bool awaits_server = false;        ///< true: the guide waits until the program tandem-server exists
  std::filesystem::path screenshot;  ///< file of the screenshot; empty: no screenshot
  Duration after{std::chrono::seconds(3)};
  int width = 1280;
  int height = 800;
  std::string molecules, molecule_colors;  ///< as in MoleculeStyle; empty: the value of the last run
};

struct ClientOptions {
  WindowOptions window;
  ClientIoSettings io;  ///< server, room, name, role, transport and simulated links
  devices::DeviceOptions device;
  std::optional<devices::DeviceOptions> second_device;  ///< device of the same user's other hand
  StageSettings stage;                                  ///< rendering stage, predictor and passivity controller
  /// Room parameters that this user sets as operator, each with its time since the join, in ascending order of time.
  std::vector<std::pair<Duration, wire::SetParameter>> sets;
  std::uint64_t seed = 1;                            ///< seed of simulated links and of the simulated hand
  std::optional<Duration> duration;                  ///< length of the run; none: it ends by a signal
  Duration start_timeout{std::chrono::seconds(60)};  ///< maximum wait for the common start; used only with `duration`
  int realtime_priority = 70;
  int cpu = -1;
  std::optional<bool> keeps_awake;  ///< see HapticLoopSettings::keeps_awake
  bool insists_on_realtime = false;
  bool prints_json = false;
  bool reads_commands = false;  ///< true: reads commands from stdin and writes the answers to stdout
  bool is_verbose = false;
  std::filesystem::path trace;  ///< file of the trace; empty: no trace
  std::uint64_t trace_every = 1;
  std::filesystem::path record;  ///< file of the recording; empty: no recording
  std::uint64_t record_every = 1;
  recording::RotationSettings record_rotation;
};

/// Parses "HOST:PORT" or "HOST", e.g. "127.0.0.1:47800".
/// Fails   std::invalid_argument if the host is missing, or if the port after a colon is missing
void apply_server(const std::string& text, ClientIoSettings& io);

/// Parses the command line. For --help and --version, prints the text to stdout and returns nothing.
///
/// Fails   std::invalid_argument if an option is unknown or has an invalid value; the message is one line with the
///         option, its value and the valid values
std::optional<ClientOptions> parse_client_options(int argc, const char* const* argv);

}  // namespace tandem::client

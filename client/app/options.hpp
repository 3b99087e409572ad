// The command line of tandem-client, checked before anything is opened.
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
  bool is_open = true;               ///< false: --headless
  std::filesystem::path screenshot;  ///< file; empty: no screenshot
  Duration after{std::chrono::seconds(3)};
  int width = 1280;
  int height = 800;
  std::string molecules, molecule_colors;  ///< names as in MoleculeStyle; empty: as remembered
};

struct ClientOptions {
  WindowOptions window;
  ClientIoSettings io;  ///< server, room, name, role, transport and simulated links
  devices::DeviceOptions device;
  std::optional<devices::DeviceOptions> second_device;  ///< device of the same user's other hand
  StageSettings stage;                                  ///< rendering stage, predictor and passivity controller
  /// Room settings that the operator makes, each with its time after joining, in order of time.
  std::vector<std::pair<Duration, wire::SetParameter>> sets;
  std::uint64_t seed = 1;                            ///< seed of the links, and as device.seed of the hand
  std::optional<Duration> duration;                  ///< none: until a signal
  Duration start_timeout{std::chrono::seconds(60)};  ///< with a duration: maximum wait for the room to begin
  int realtime_priority = 70;
  int cpu = -1;
  std::optional<bool> keeps_awake;  ///< see HapticLoopSettings::keeps_awake
  bool insists_on_realtime = false;
  bool prints_json = false;
  bool reads_commands = false;  ///< reads commands from stdin and writes the answers to stdout
  bool is_verbose = false;
  std::filesystem::path trace;  ///< file; empty: no trace
  std::uint64_t trace_every = 1;
  std::filesystem::path record;  ///< file; empty: no recording
  std::uint64_t record_every = 1;
  recording::RotationSettings record_rotation;
};

/// Parses "127.0.0.1:47800", or a host without the port.
/// Fails   std::invalid_argument: no address, or no port after the colon
void apply_server(const std::string& text, ClientIoSettings& io);

/// Parses the command line. Empty after --help or --version, which are answered on stdout.
///
/// Fails   std::invalid_argument: one line that names the option, the value and the valid values
std::optional<ClientOptions> parse_client_options(int argc, const char* const* argv);

}  // namespace tandem::client

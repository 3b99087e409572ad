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

/// What a window shows of itself, and when it takes a picture.
struct WindowOptions {
  bool is_open = true;               ///< false: --headless
  std::filesystem::path screenshot;  ///< empty: none
  Duration after{std::chrono::seconds(3)};
  int width = 1280;
  int height = 800;
  std::string molecules, molecule_colors;  ///< of MoleculeStyle's names; empty: as remembered
};

struct ClientOptions {
  WindowOptions window;
  ClientIoSettings io;  ///< server, room, name, role, transport and simulated links
  devices::DeviceOptions device;
  std::optional<devices::DeviceOptions> second_device;  ///< of the same person's other hand
  StageSettings stage;                                  ///< what the hand is shown, predictor and passivity controller
  /// Of the room, by its operator: each so long after joining, the first first.
  std::vector<std::pair<Duration, wire::SetParameter>> sets;
  std::uint64_t seed = 1;                            ///< of the links, and as device.seed of the hand
  std::optional<Duration> duration;                  ///< none: until a signal
  Duration start_timeout{std::chrono::seconds(60)};  ///< with a duration: how long to wait for the room to begin
  int realtime_priority = 70;
  int cpu = -1;
  std::optional<bool> keeps_awake;  ///< as HapticLoopSettings has it
  bool insists_on_realtime = false;
  bool prints_json = false;
  bool reads_commands = false;  ///< from the standard input, and answers them on the standard output
  bool is_verbose = false;
  std::filesystem::path trace;  ///< empty: none
  std::uint64_t trace_every = 1;
  std::filesystem::path record;  ///< empty: nothing is recorded
  std::uint64_t record_every = 1;
  recording::RotationSettings record_rotation;
};

/// "127.0.0.1:47800", or without the port.
/// Fails   std::invalid_argument: no address, or no port after the colon
void take_server(const std::string& text, ClientIoSettings& io);

/// Empty when --help or --version was asked for, and answered on stdout.
///
/// Fails   std::invalid_argument: one line that names the option, the value and what would do
std::optional<ClientOptions> parse_client_options(int argc, const char* const* argv);

}  // namespace tandem::client

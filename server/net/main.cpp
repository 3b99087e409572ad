// tandem-server: opens rooms with scenes, and serves them until it is told to stop.
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <random>

#include "common/units.hpp"
#include "server/net/live_server.hpp"
#include "server/net/scene_library.hpp"
#include "server/net/server_report.hpp"

namespace {

using namespace tandem;

constexpr int kSetupError = 2;

struct Options {
  std::vector<std::string> scenes;
  std::vector<std::string> rooms;
  std::string bind = "127.0.0.1";
  std::uint16_t port = 47800;
  std::string duration;
  int realtime_priority = 60;
  bool writes_json = false;
};

void declare(CLI::App& app, Options& options) {
  app.set_version_flag("--version", "tandem-server " TANDEM_VERSION);
  app.add_option("--scene", options.scenes, "scene file, or name of a scene that comes with Tandem; one room each")
      ->required()
      ->type_name("FILE|NAME");
  app.add_option("--room", options.rooms, "name of the room, in the order of --scene [default: the scene's name]")
      ->type_name("NAME");
  app.add_option("--port", options.port, "TCP and UDP port; 0: any free one, printed")->capture_default_str();
  app.add_option("--bind", options.bind, "address to listen on; loopback only, the transport is not encrypted yet")
      ->capture_default_str();
  app.add_option("--duration", options.duration, "stop after this long, with unit, e.g. 30s [default: never]")
      ->type_name("TIME");
  app.add_option("--rt-priority", options.realtime_priority,
                 "SCHED_FIFO priority of the room threads, io one above; 0: normal scheduler")
      ->check(CLI::Range(0, 98))
      ->capture_default_str();
  app.add_flag("--json", options.writes_json, "print what the server did as one JSON object at the end");
}

std::vector<std::unique_ptr<Room>> open_rooms(const Options& options) {
  if (options.rooms.size() > options.scenes.size()) throw std::invalid_argument("more --room than --scene were given");
  std::vector<std::unique_ptr<Room>> rooms;
  for (std::size_t i = 0; i < options.scenes.size(); ++i) {
    const auto scene = load_scene(find_scene(options.scenes[i], scene_folders()));
    const std::string name = i < options.rooms.size() ? options.rooms[i] : scene->description.name();
    for (const auto& other : rooms) {
      if (other->name() == name) {
        throw std::invalid_argument("two rooms are called \"" + name + "\"; name them with --room");
      }
    }
    rooms.push_back(std::make_unique<Room>(RoomId{static_cast<std::uint32_t>(i + 1)}, name, scene));
  }
  return rooms;
}

/// Connection ids must not be guessed.
std::uint64_t entropy() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

void print_ready(const LiveServer& server, const std::string& address) {
  std::cout << "tandem-server: listening on " << address << ":" << server.port();
  for (const auto& room : server.rooms()) {
    const std::size_t tools = room->scene().tools.size();
    std::cout << ", room " << room->name() << " (" << tools << (tools == 1 ? " tool)" : " tools)");
  }
  std::cout << std::endl;
}

void serve(const Options& options) {
  LiveServerSettings settings;
  settings.bind_address = options.bind;
  settings.port = options.port;
  settings.realtime_priority = options.realtime_priority;
  if (!options.duration.empty()) settings.duration = parse_duration(options.duration);
  settings.stops_on_signals = true;
  settings.hub.seed = entropy();
  LiveServer server(settings, open_rooms(options));
  // Not before all set-up has worked: an error is then the only line.
  for (const auto& room : server.rooms()) {
    for (const std::string& note : room->scene().notes) spdlog::info("{}: {}", room->name(), note);
  }
  server.on_log = [](const std::string& line) { spdlog::info("{}", line); };
  print_ready(server, options.bind);
  server.run();
  if (options.writes_json) std::cout << boost::json::serialize(report_json(server)) << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_logger_st("tandem-server"));
  spdlog::set_pattern("%H:%M:%S.%e %l %v");
  Options options;
  CLI::App app("Serves shared haptic scenes: one room a scene, one fixed-step loop a room.");
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    std::cerr << "tandem-server: " << error.what() << "; see --help" << std::endl;
    return kSetupError;
  }
  try {
    serve(options);
  } catch (const std::exception& error) {
    std::cerr << "tandem-server: " << error.what() << std::endl;
    return kSetupError;
  }
  return 0;
}

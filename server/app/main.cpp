// The program tandem-server, which opens rooms with scenes and serves them until it is stopped.
#include <CLI/CLI.hpp>
#include <iomanip>
#include <optional>
#include <sstream>

#include "common/base/progress.hpp"
#include "common/base/units.hpp"
#include "common/net/host_port.hpp"
#include "common/realtime/output.hpp"
#include "common/secure/certificate.hpp"
#include "server/app/docking_options.hpp"
#include "server/app/security.hpp"
#include "server/app/server_report.hpp"
#include "server/assets/scene_library.hpp"
#include "server/docking/pose_keeper.hpp"
#include "server/metrics/monitor.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_checkpoint.hpp"
#include "server/recording/server_recorder.hpp"
#include "server/session/call_program.hpp"
#include "server/session/user_name.hpp"

namespace {

using namespace tandem;

constexpr int kFault = 1, kSetupError = 2;

struct Options {
  std::vector<std::string> scenes;
  server::WriteDockingScene write_docking_scene;
  std::vector<std::string> rooms;
  std::string bind = "127.0.0.1";
  int port = 47800;
  std::optional<Duration> duration;
  Duration build_limit = std::chrono::minutes(2);
  std::string cache = default_cache_directory().string();
  int realtime_priority = 60;
  bool controls_tool_passivity = true;
  server::RoomStartSettings start;
  bool writes_json = false;
  bool is_insecure = false;
  server::SecurityOptions security;
  std::string address;  ///< public address of this server for clients; empty: own_address()
  int invitations = 0;
  server::Invited invited;
  std::filesystem::path dev_certificates;
  bool resumes = false;
  std::optional<std::filesystem::path> keep;  ///< folder for saved poses; none: in the folder of the server's state
  std::filesystem::path record;               ///< empty: no recording
  recording::RotationSettings rotation;
  std::optional<std::string> metrics;  ///< address of the metrics port, as [ADDRESS:]PORT
  std::optional<std::string> agones;   ///< port of Agones' sidecar, or "auto"
  std::filesystem::path on_call;       ///< program that is run when a game calls a person; empty: none
};

void add_duration(CLI::App& app, const std::string& name, const std::string& help,
                  const std::function<void(Duration)>& store) {
  const auto parse = [name, store](const std::string& text) {
    try {
      store(parse_duration(text, "s"));
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError(name, error.what());
    }
  };
  app.add_option_function<std::string>(name, parse, help)->type_name("TIME");
}

void declare_security(CLI::App& app, Options& options) {
  app.add_option_function<int>(
         "--invite", [&options](int number) { options.invitations = number; },
         "number of invitations to print, each for one person, to be pasted after tandem-client --join within --valid; "
         "tandem-token makes more [0; 1 without a number]")
      ->expected(0, 1)
      ->default_str("1")
      ->check(CLI::Range(1, 64).description(""))
      ->type_name("N");
  app.add_option("--invite-role", options.invited.role,
                 "role of the invited user, or a lesser one; signal: a program such as tandem-signal")
      ->check(CLI::IsMember({"manipulator", "operator", "observer", "signal"}).description(""))
      ->capture_default_str()
      ->type_name("manipulator|operator|observer|signal");
  app.add_option_function<std::string>(
         "--valid",
         [&options](const std::string& text) {
           try {
             options.invited.life = server::valid_for(text);
           } catch (const std::invalid_argument& error) {
             throw CLI::ValidationError(error.what());
           }
         },
         "until when an invitation of --invite must be used, with unit (s, min, h or d), at most 30d; restarts of the "
         "server do not end it [15min]")
      ->type_name("TIME");
  app.add_option(
         "--address", options.address,
         "name or address, without a port, by which others reach this server, for invitations and --dev-certs [an "
         "address of this machine]")
      ->type_name("ADDRESS|NAME");
  app.add_option("--state", options.security.state,
                 "folder of the keys that the server makes itself, and of the list of used invitations")
      ->capture_default_str()
      ->type_name("DIR");
  app.add_option("--cert", options.security.certificate, "certificate of the server, with those below the authority's")
      ->type_name("FILE.pem");
  app.add_option("--key", options.security.key, "its private key, without a password")->type_name("FILE.pem");
  app.add_option("--issuer", options.security.issuers,
                 "public key of a service whose join tokens are accepted too (tandem-token)")
      ->type_name("KEY");
  app.add_option("--dev-certs", options.dev_certificates,
                 "make a private authority and a certificate for this server in a new folder, and end")
      ->type_name("DIR");
  app.add_flag("--insecure", options.is_insecure,
               "nothing is encrypted and everybody may join; for clients on this machine only");
}

void declare_recording(CLI::App& app, Options& options) {
  app.add_flag("--resume", options.resumes,
               "store in --state, every 0.5 s, the poses of bodies and the users who may rejoin; after a restart the "
               "server continues from there (used invitations are always stored there)");
  app.add_option_function<std::string>(
         "--keep", [&options](const std::string& folder) { options.keep = folder; },
         "folder of the poses of two molecules that users keep: lists and structure files (\"\": none are written) "
         "[default: poses in --state]")
      ->type_name("DIR");
  app.add_option("--record", options.record,
                 "record each room into a file in this folder (MCAP; tandem-replay reads it): the data for its "
                 "playback, and all poses")
      ->type_name("DIR");
  app.add_option_function<double>(
         "--record-rotate-size",
         [&options](double megabytes) { options.rotation.max_bytes = static_cast<std::uint64_t>(megabytes * 1e6); },
         "begin another file after this size [MB]; 0: never [1000]")
      ->check(CLI::Range(0.0, 1e6).description(""))
      ->type_name("MB");
  add_duration(app, "--record-rotate-age", "begin another file after this long, with unit; 0s: never [default: 3600s]",
               [&options](Duration age) { options.rotation.max_age = age; });
}

void declare_monitoring(CLI::App& app, Options& options) {
  app.add_option("--metrics", options.metrics,
                 "answer GET /metrics (Prometheus), /healthz and /readyz over HTTP at this port of this machine's own; "
                 "0: any free one, printed")
      ->type_name("[ADDRESS:]PORT");
  app.add_option_function<std::string>(
         "--agones", [&options](const std::string& port) { options.agones = port; },
         "report the state of the server to the Agones sidecar on this machine, in Kubernetes; auto: at the port "
         "$AGONES_SDK_HTTP_PORT, else 9358")
      ->expected(0, 1)
      ->default_str("auto")
      ->type_name("PORT");
  app.add_option("--on-call", options.on_call,
                 "program to run when a game calls a person who looks after its users, for at most 10 s, without a "
                 "shell; its arguments are the room and the reason: time-limit or state-limit")
      ->type_name("PROGRAM");
}

void declare(CLI::App& app, Options& options) {
  app.set_version_flag("--version", "tandem-server " TANDEM_VERSION);
  app.footer("Exit code: 0 done, 1 ended by a fault or with an incomplete recording, 2 bad input or set-up.");
  app.set_config("--config", "",
                 "file with options under these names without the dashes; the command line has precedence")
      ->type_name("FILE");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.add_option("--scene", options.scenes, "scene file, or name of a scene that comes with Tandem; one room each")
      ->type_name("FILE|NAME");
  options.write_docking_scene = server::declare_docking(app);
  app.add_option("--room", options.rooms,
                 "name of the room, in the order of --scene, then of --receptor [default: the scene's name]")
      ->type_name("NAME");
  app.add_option("--port", options.port, "TCP and UDP port, 0 to 65535; 0: any free one, printed")
      ->check(CLI::Range(0, 65535).description(""))
      ->type_name("PORT")
      ->capture_default_str();
  app.add_option("--bind", options.bind,
                 "address to listen on, e.g. 0.0.0.0 for all IPv4 addresses of this machine, :: for those of IPv6 and "
                 "IPv4; with --insecure loopback only")
      ->capture_default_str();
  add_duration(app, "--duration", "stop after this long, with unit, e.g. 30s [default: never]",
               [&options](Duration duration) { options.duration = duration; });
  app.add_option_function<std::string>(
         "--passivity,--guard", [&options](const std::string& text) { options.controls_tool_passivity = text == "on"; },
         "limit the energy that a tool puts into the world to the energy that its user's hand put in [on]")
      ->check(CLI::IsMember({"on", "off"}).description(""))
      ->type_name("on|off");
  app.add_option("--begin-with", options.start.users,
                 "simulated and recorded hands of a room begin together, once this many users with a tool have joined; "
                 "0: each by itself")
      ->check(CLI::Range(std::size_t{0}, proto::kMaxUsers).description(""))
      ->type_name("N")
      ->capture_default_str();
  add_duration(app, "--countdown", "with --begin-with: from the last user's arrival to the start, 0s to 60s [3s]",
               [&options](Duration countdown) {
                 if (countdown < Duration{0} || countdown > std::chrono::seconds(60))
                   throw std::invalid_argument("it must be 0s to 60s");
                 options.start.countdown = countdown;
               });
  app.add_option("--cache", options.cache,
                 "folder that keeps the contact shapes built from meshes (\"\": none, build at every start) and the "
                 "scenes of --receptor")
      ->type_name("DIR")
      ->capture_default_str();
  app.add_option("--rt-priority", options.realtime_priority,
                 "SCHED_FIFO priority of the room threads; 0: normal scheduler")
      ->check(CLI::Range(0, 98))
      ->capture_default_str();
  add_duration(app, "--build-limit",
               "refuse a scene whose meshes take longer to be made ready for touch, with unit [default: 120s]",
               [&options](Duration limit) { options.build_limit = limit; });
  declare_security(app, options);
  declare_recording(app, options);
  declare_monitoring(app, options);
  app.add_flag("--json", options.writes_json,
               "print a summary as one JSON object at the end; the ready line then goes to stderr");
}

/// Returns a note with the duration of a step on this machine. Throws if a step takes longer than its period, because
/// then every step would be late.
std::string machine_note(const server::LoadedScene& scene, Duration step) {
  const double rate_hz = scene.description.step_rate_hz(), most_ms = 1e3 / rate_hz, step_ms = to_seconds(step) * 1e3;
  std::ostringstream text;
  text << std::setprecision(3) << "scene " << scene.description.name() << ": a step with every tool at its start takes "
       << step_ms << " ms on this machine, of the " << most_ms << " ms that it has at " << rate_hz << " Hz";
  if (step_ms > most_ms) {
    throw std::invalid_argument(text.str() +
                                "; give it fewer or smaller molecules, meshes or soft bodies, or a lower step_rate_hz");
  }
  return text.str();
}

std::vector<std::unique_ptr<server::Room>> open_rooms(const Options& options, realtime::Output& output) {
  // --scene is checked here and not by CLI11. Otherwise, after a misspelt option, CLI11 would report the missing
  // --scene instead of the mistake.
  if (options.scenes.empty())
    throw std::invalid_argument(
        "--scene is required, e.g. --scene peg_in_hole, or --receptor and --ligand; see --help");
  if (options.rooms.size() > options.scenes.size()) throw std::invalid_argument("more --room than --scene were given");
  std::vector<std::unique_ptr<server::Room>> rooms;
  const server::SceneLoading loading{
      .cache_directory = options.cache,
      .progress = progress_on_stderr([&output](const std::string& text) { output.err(text); }),
      .warn = [&output](const std::string& warning) { output.log("scene", "warning: " + warning); },
      .max_build = options.build_limit};
  for (std::size_t i = 0; i < options.scenes.size(); ++i) {
    const auto scene = server::load_scene(server::find_scene(options.scenes[i], server::scene_folders()), loading);
    const std::string name = i < options.rooms.size() ? options.rooms[i] : scene->description.name();
    if (!server::is_acceptable_user_name(name)) {
      throw std::invalid_argument("--room \"" + name + "\" must be 1 to 64 bytes of printable UTF-8");
    }
    for (const auto& other : rooms) {
      if (other->name() == name) {
        throw std::invalid_argument("two rooms are called \"" + name + "\"; name them with --room");
      }
    }
    if (options.start.users > scene->world.tools.size()) {
      throw std::invalid_argument("--begin-with " + std::to_string(options.start.users) + ": room " + name + " has " +
                                  counted(scene->world.tools.size(), "tool", "tools") +
                                  " and would never begin; give at most as many");
    }
    rooms.push_back(
        std::make_unique<server::Room>(RoomId{static_cast<std::uint32_t>(i + 1)}, name, scene,
                                       server::RoomOptions{.steps_soft_aside = true,
                                                           .controls_tool_passivity = options.controls_tool_passivity,
                                                           .start = options.start}));
  }
  return rooms;
}

/// Describes an error in the options in one line. If the option comes from a configuration file, the line names that
/// file.
std::string mistake(const CLI::App& app, const CLI::ParseError& error) {
  constexpr std::string_view kUnknownInFile = "INI was not able to parse ";
  const std::string what = error.what();
  const std::string file = app.get_config_ptr()->as<std::string>();
  if (what.starts_with(kUnknownInFile)) {
    return file + ": no option is called " + what.substr(kUnknownInFile.size()) + "; see --help";
  }
  if (dynamic_cast<const CLI::FileError*>(&error) != nullptr) {
    return "--config " + file + " cannot be read; give the path of a file";
  }
  return what + "; see --help" + (file.empty() ? "" : " and " + file);
}

std::string ready_line(const server::LiveServer& server, const std::string& address,
                       const std::optional<server::ServerKeys>& keys) {
  std::string line = "tandem-server: listening on " + net::text_of(address, server.port());
  line += keys ? ", key " + secure::text_of(keys->identity.id()) : std::string(", INSECURE: nothing is encrypted");
  for (const auto& room : server.rooms()) {
    line += ", room " + room->name() + " (" + counted(room->scene().world.tools.size(), "tool", "tools") + ")";
  }
  return line + "\n";
}

std::string address_for_clients(const Options& options) {
  if (!options.address.empty()) return net::host_without_port("--address", options.address);
  if (options.bind == "0.0.0.0") return server::own_address(false);
  return options.bind == "::" ? server::own_address(true) : options.bind;
}

std::string invitations(const Options& options, std::uint16_t port, const server::ServerKeys& keys) {
  const std::string address = net::text_of(address_for_clients(options), port);
  std::string lines;
  for (int i = 0; i < options.invitations; ++i) {
    lines += server::invitation_line(options.invited, address, keys) + "\n";
  }
  return lines;
}

/// Returns a warning if the server listens on loopback only, so that its invitations cannot be used on other machines.
/// Otherwise returns an empty string.
std::string reach_of_invitations(const Options& options) {
  if (options.invitations == 0 || !server::is_loopback(options.bind)) return "";
  return "warning: the server listens on " + options.bind +
         " only, so these invitations can be used on this machine alone; for other machines give --bind 0.0.0.0 (or "
         "::)";
}

void make_dev_certificates(const Options& options, realtime::Output& output) {
  const std::filesystem::path& folder = options.dev_certificates;
  secure::write_dev_certificates(folder, {address_for_clients(options), server::own_address(true),
                                          server::own_host_name(), "localhost", "127.0.0.1", "::1"});
  output.out("made " + folder.string() + "/{ca,server}.pem and their keys\n  tandem-server --cert " +
             (folder / "server.pem").string() + " --key " + (folder / "server-key.pem").string() +
             " ...\n  tandem-client --ca ca.pem --token TOKEN ...   (a copy of ca.pem; keep ca-key.pem to yourself)\n");
}

/// Runs the server until it stops, and returns the exit code. The code kFault means that a fault occurred after a
/// successful set-up, so a supervisor should restart the program.
int run(server::LiveServer& server, realtime::Output& output) {
  try {
    server.run();
    return 0;
  } catch (const std::exception& error) {
    output.err(std::string("tandem-server: ended by a fault: ") + error.what() + "\n");
    return kFault;
  }
}

/// Returns the absolute path of a scene file, or the name of a shipped scene unchanged.
std::string scene_name(const std::string& named) {
  std::error_code error;
  return std::filesystem::exists(named, error) ? std::filesystem::absolute(named).string() : named;
}

std::string key_text(const secure::KeyId& id) {
  return {reinterpret_cast<const char*>(id.data()), id.size()};
}

/// Starts the recorder that --record requests. Returns null if no recording is requested.
server::ServerRecorder* start_recording(const Options& options, server::LiveServer& server,
                                        const server::ServerCheckpoint* checkpoint, realtime::Output& output) {
  if (options.record.empty()) return nullptr;
  std::vector<server::RoomRecording> settings(server.rooms().size());
  const Duration unix_offset =
      std::chrono::system_clock::now().time_since_epoch() - SteadyClock().now().time_since_epoch();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    settings[i].program = "tandem-server " TANDEM_VERSION;
    settings[i].scene_file = scene_name(options.scenes[i]);
    settings[i].recording = secure::random_u64();
    settings[i].unix_offset = unix_offset;
    settings[i].rotation = options.rotation;
    if (checkpoint != nullptr) settings[i].restored = checkpoint->restored(i);
  }
  return server.add(std::make_unique<server::ServerRecorder>(
      options.record, server.rooms(), settings, [&output](const std::string& news) { output.log("record", news); }));
}

/// Returns the number of messages and steps that are missing from a finished recording.
std::uint64_t lost_of(const server::ServerRecorder& recorder) {
  std::uint64_t lost = 0;
  for (const auto& room : recorder.rooms()) lost += room->file().messages_lost() + room->steps_lost();
  return lost;
}

/// Returns a warning if the game of a room calls a person but --on-call names no program; otherwise an empty string.
std::string missing_call(const Options& options, const server::Room& room) {
  const wire::CallRule& call = room.scene().description.game().call();
  if (!options.on_call.empty() || !(call.at_time_limit() || call.at_state_limit())) return "";
  return "room " + room.name() +
         ": its game calls a person, and --on-call is missing, so only its users see the call; give --on-call PROGRAM, "
         "which is run with the room and the reason";
}

int serve(const Options& options, realtime::Output& output) {
  std::optional<std::uint16_t> agones;
  if (options.agones) agones = server::agones_port(*options.agones);
  server::Monitor monitor(options.metrics, agones, [&output](const std::string& news) { output.log("agones", news); });
  server::LiveServerSettings settings;
  settings.bind_address = options.bind;
  settings.port = static_cast<std::uint16_t>(options.port);
  settings.realtime_priority = options.realtime_priority;
  if (options.duration) settings.duration = *options.duration;
  settings.stops_on_signals = true;
  if (options.is_insecure && options.invitations > 0) {
    throw std::invalid_argument("--insecure needs no --invite: everybody on this machine may join");
  }
  std::optional<server::ServerKeys> keys;
  std::shared_ptr<void> lock;
  std::unique_ptr<server::InvitationLedger> ledger;  // must outlive the server
  if (!options.is_insecure || options.resumes) lock = server::lock_state(options.security.state);
  if (!options.is_insecure) {
    keys = server::open_keys(options.security);
    settings.tls = server::tls_of(*keys);
    settings.hub.admission = server::admission_of(*keys, options.security);
    ledger = std::make_unique<server::InvitationLedger>(
        server::ledger_file(options.security.state),
        [&output](const std::string& news) { output.log("invitations", news); });
    settings.hub.admission->ledger = ledger.get();
  }
  server::ServerRooms rooms(open_rooms(options, output));
  server::ServerCheckpoint* checkpoint = nullptr;
  if (options.resumes) {
    checkpoint = rooms.add(std::make_unique<server::ServerCheckpoint>(
        options.security.state, rooms.rooms(), keys ? key_text(keys->identity.id()) : "", server::unix_ms_now,
        [&output](const std::string& news) { output.log("checkpoint", news); }));
    if (keys) settings.hub.admission->resumed = checkpoint->admission();
  }
  const std::filesystem::path keep = options.keep.value_or(
      options.security.state.empty() ? std::filesystem::path() : options.security.state / "poses");
  server::PoseKeeper* const poses =
      rooms.add(std::make_unique<server::PoseKeeper>(keep, rooms.rooms(), server::unix_ms_now));
  settings.hub.poses = poses;
  if (!options.on_call.empty()) {
    auto* const program = rooms.add(std::make_unique<server::CallProgram>(
        options.on_call, [&output](const std::string& news) { output.log("call", news); }));
    settings.hub.on_call = [program](const std::string& room, const std::string& reason) {
      program->call(room, reason);
    };
  }
  server::LiveServer server(settings, std::move(rooms));
  std::vector<std::string> machine_notes;
  for (const auto& room : server.rooms()) {
    machine_notes.push_back(machine_note(room->scene(), server::quickest_step(room->shared_scene())));
  }
  if (ledger) ledger->begin(options.resumes, server::unix_ms_now());
  // Notes are logged only after the whole set-up. If the set-up fails, its error is then the only output.
  for (const std::string& note : machine_notes) output.log("scene", note);
  for (const auto& room : server.rooms()) {
    for (const std::string& note : room->scene().notes) output.log("scene", room->name() + ": " + note);
    if (const std::string note = missing_call(options, *room); !note.empty()) output.log("call", note);
  }
  const server::ServerRecorder* const recorder = start_recording(options, server, checkpoint, output);
  monitor.watch(server, recorder, checkpoint);
  if (!monitor.address().empty()) output.log("metrics", "metrics at http://" + monitor.address() + "/metrics");
  if (checkpoint != nullptr)
    server.on_admission = [checkpoint](const wire::AdmissionState& state) { checkpoint->note(state); };
  server.on_log = [&output](std::string_view kind, const std::string& line) { output.log(kind, line); };
  // With --json, stdout carries only the final report, a JSON object. The ready line goes to stderr.
  std::string ready = ready_line(server, options.bind, keys);
  if (keys) ready += invitations(options, server.port(), *keys);
  options.writes_json ? output.err(ready) : output.out(ready);
  if (const std::string warning = reach_of_invitations(options); !warning.empty()) output.log("invite", warning);
  poses->start();
  if (ledger) ledger->start();
  if (checkpoint) checkpoint->start();
  const int code = run(server, output);
  if (ledger) ledger->finish();
  if (options.writes_json) output.out(boost::json::serialize(server::report_json(server, recorder)) + "\n");
  const std::uint64_t lost = recorder != nullptr ? lost_of(*recorder) : 0;
  if (lost == 0) return code;
  output.err("tandem-server: --record: the recording is incomplete: " + std::to_string(lost) +
             " messages are not in it\n");
  return kFault;
}

/// Runs the program and returns the exit code.
int run(int argc, char** argv, realtime::Output& output) {
  Options options;
  CLI::App app("Serves shared haptic scenes: one room a scene, one fixed-step loop a room.", "tandem-server");
  declare(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    output.err("tandem-server: " + mistake(app, error) + "\n");
    return kSetupError;
  }
  try {
    if (!options.dev_certificates.empty()) {
      make_dev_certificates(options, output);
      return 0;
    }
    const std::filesystem::path docking = options.write_docking_scene(options.cache);
    if (!docking.empty()) options.scenes.push_back(docking.string());
    return serve(options, output);
  } catch (const std::exception& error) {
    output.err(std::string("tandem-server: ") + error.what() + "\n");
    return kSetupError;
  }
}

}  // namespace

int main(int argc, char** argv) {
  static tandem::realtime::Output output("tandem-server");
  const int code = run(argc, argv, output);
  output.finish();
  return code;
}

// See options.hpp.
#include "client/app/options.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "client/app/device_options.hpp"
#include "client/app/option_types.hpp"
#include "client/app/room_parameter.hpp"
#include "client/app/security_options.hpp"
#include "client/commands/command.hpp"
#include "client/session/asset_store.hpp"
#include "client/view/window.hpp"
#include "common/base/folders.hpp"
#include "common/base/units.hpp"
#include "common/net/deadband.hpp"
#include "common/net/host_port.hpp"

namespace tandem::client {
namespace {

std::vector<std::string> owned(const std::vector<std::string_view>& names) {
  return {names.begin(), names.end()};
}

template <class T>
T chosen(const std::string& text, const std::map<std::string_view, T>& choices) {
  const auto found = choices.find(text);
  if (found != choices.end()) return found->second;
  std::vector<std::string_view> names;
  names.reserve(choices.size());
  for (const auto& [name, value] : choices) names.push_back(name);
  throw std::invalid_argument("'" + text + "' does not exist; use one of: " + listed(names));
}

void add_session_options(CLI::App& app, ClientOptions& options) {
  ClientIoSettings& io = options.io;
  add_text(
      app, "--server",
      "server to join, by name or address, an IPv6 address in brackets [127.0.0.1:47800]; with --ca by its name in the "
      "certificate",
      "ADDRESS:PORT", [&io](const std::string& text) { apply_server(text, io); });
  app.add_option("--room", io.client.session.room, "room to join; default: the server's only room");
  app.add_option("--name", io.client.session.user_name, "your name in the room")->capture_default_str();
  add_text(app, "--role", "your role; the operator of a room, one at most, may also set its parameters [manipulator]",
           "manipulator|operator|observer", [&io](const std::string& text) {
             io.client.session.role = chosen<wire::Role>(text, {{"manipulator", wire::ROLE_MANIPULATOR},
                                                                {"operator", wire::ROLE_OPERATOR},
                                                                {"observer", wire::ROLE_OBSERVER}});
           });
  add_text(app, "--transport", "transport of the state [udp]; tcp where UDP is blocked", "udp|tcp",
           [&io](const std::string& text) {
             io.client.session.state_over_tcp = chosen<bool>(text, {{"udp", false}, {"tcp", true}});
           });
}

void add_deadband_option(CLI::App& app, ClientOptions& options) {
  add_text(
      app, "--deadband",
      "change of force or motion that is not sent at once, as a share of it, 0% to 50%; both directions, 100 Hz are "
      "always sent [0%]; the just-noticeable difference is about 10%",
      "SHARE", [&options](const std::string& text) {
        options.io.client.session.deadband = parse_fraction(text, net::kMaxDeadband);
      });
}

void add_workspace_options(CLI::App& app, ClientOptions& options) {
  WorkspaceSettings& workspace = options.io.client.session.workspace;
  add_number(app, "--workspace-scale", workspace.scale, 0.1, 10,
             "factor on the scene's ratio of tool motion to hand motion; forces at the device grow by the same factor, "
             "so that work is unchanged",
             "FACTOR");
  add_text(app, "--workspace-turn",
           "turn of your device about the scene's vertical, as you look at it, -180 to 180 [0]", "DEGREES",
           [&workspace](const std::string& text) {
             double degrees = 0;
             if (!CLI::detail::lexical_cast(text, degrees) || !(std::abs(degrees) <= 180)) {
               throw std::invalid_argument("'" + text + "' must be a number from -180 to 180");
             }
             workspace.turn_rad = degrees * std::numbers::pi / 180;
           });
  add_text(app, "--border", "at the border of your device's workspace a soft wall is felt and the tool moves on [on]",
           "on|off", [&options](const std::string& text) {
             options.io.client.haptics.has_border = chosen<bool>(text, {{"on", true}, {"off", false}});
           });
}

void add_nudge_option(CLI::App& app, ClientOptions& options) {
  add_text(app, "--nudge",
           "a place that another user points at nudges your hand, at most once in 5 s; off: you only see it [on]",
           "on|off", [&options](const std::string& text) {
             options.io.client.session.has_nudges = chosen<bool>(text, {{"on", true}, {"off", false}});
           });
}

void add_stage_options(CLI::App& app, StageSettings& stage) {
  app.add_option("--stage", stage.name, "stage that renders the force on the hand: " + listed_stage_names())
      ->capture_default_str()
      ->check(CLI::IsMember(owned(stage_names())).description(""))
      ->type_name("NAME");
  app.add_option("--predictor", stage.predictor,
                 "predictor of the residual force (server minus local model), in stages with a local model; none: no "
                 "prediction, also not of other users' hands: " +
                     listed_predictor_names())
      ->capture_default_str()
      ->check(CLI::IsMember(owned(predictor_names())).description(""))
      ->type_name("NAME");
  add_text(app, "--passivity,--guard", "limit the energy that the hand receives to the energy that was put in [on]",
           "on|off", [&stage](const std::string& text) {
             stage.passivity = chosen<bool>(text, {{"on", true}, {"off", false}});
           });
  add_number(app, "--wave-impedance", stage.wave.linear_n_s_per_m, 0.1, 1000, "of the stage wave [N*s/m]", "N*S/M");
  add_number(app, "--wave-impedance-angular", stage.wave.angular_n_m_s_per_rad, 1e-4, 10,
             "of the stage wave [N*m*s/rad]", "N*M*S/RAD");
}

void add_set_option(CLI::App& app, std::vector<std::pair<Duration, wire::SetParameter>>& sets) {
  app.add_option_function<std::vector<std::string>>(
         "--set",
         [&sets](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) {
             try {
               sets.push_back(parameter_to_set(text));
             } catch (const std::invalid_argument& error) {
               throw CLI::ValidationError("--set", error.what());
             }
           }
           std::ranges::stable_sort(sets, {}, [](const auto& set) { return set.first; });
         },
         "as the room's operator, set a parameter of the room, at once or TIME after joining, until you leave: "
         "coupling.law=spring-damper, coupling.stiffness_n_per_m=400@5s, ...")
      ->type_name("NAME=VALUE[@TIME]")
      ->allow_extra_args(false);
}

/// Adds the options of a simulated link; its parameters apply to both directions. `is_used` becomes true if the command
/// line contains one of these options.
void add_link_options(CLI::App& app, net::LinkParameters& link, bool& is_used) {
  const auto add = [&app, &is_used](const std::string& name, const std::string& help, const std::string& type,
                                    std::function<void(const std::string&)> store) {
    add_text(app, name, help, type, [&is_used, store = std::move(store)](const std::string& text) {
      is_used = true;
      store(text);
    });
  };
  const std::string each = " in each direction";
  add("--delay", "simulated one-way delay" + each + ", e.g. 25ms", "TIME",
      [&link](const std::string& text) { link.delay = parse_duration(text); });
  add("--jitter",
      "its standard deviation, e.g. 5ms; without --reorder a late datagram holds up those behind it, so they arrive in "
      "bursts",
      "TIME", [&link](const std::string& text) { link.jitter = parse_duration(text); });
  add("--loss", "share of datagrams lost" + each + ", 0% to 95%, in bad periods of 20 ms, e.g. 1%", "SHARE",
      [&link](const std::string& text) { link.loss = parse_fraction(text, net::kMaxLoss); });
  add("--duplication", "share of datagrams delivered twice, e.g. 1%", "SHARE",
      [&link](const std::string& text) { link.duplication = parse_fraction(text); });
  app.add_option_function<double>(
         "--rate-limit",
         [&link, &is_used](double value) {
           link.rate_limit_bytes_per_s = value;
           is_used = true;
         },
         "capacity" + each + ", of datagrams and control together [bytes/s]")
      ->type_name("BYTES/S");
  app.add_flag_callback(
      "--reorder", [&link, &is_used] { link.allows_reordering = is_used = true; }, "allow jitter to reorder datagrams");
}

int last_cpu() {
  return static_cast<int>(std::max(1L, sysconf(_SC_NPROCESSORS_CONF))) - 1;
}

#ifdef TANDEM_HAS_WINDOW
constexpr const char* kHeadlessHelp = "without a window";
#else
constexpr const char* kHeadlessHelp = "without a window; required, for this program was built without one";
#endif

void parse_size(const std::string& text, WindowOptions& window) {
  const auto number = [&text](std::size_t from, std::size_t to) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data() + from, text.data() + to, value);
    const bool is_good = error == std::errc() && end == text.data() + to && value >= 200 && value <= 8192;
    if (!is_good) throw std::invalid_argument("'" + text + "' must be of numbers from 200 to 8192, e.g. 1280x800");
    return value;
  };
  const std::size_t cross = std::min(text.find('x'), text.size());
  window.width = number(0, cross);
  window.height = number(std::min(cross + 1, text.size()), text.size());
}

void add_window_options(CLI::App& app, WindowOptions& window, bool& is_headless) {
  app.add_flag("--headless", is_headless, kHeadlessHelp);
  app.add_flag("--guide", window.begins_guide,
               "a guided first minute in the window, where you left it; without a server it opens the scene crate");
  app.add_flag("--await-server", window.awaits_server,
               "with --guide: wait until tandem-server exists beside this program, e.g. because it is being compiled");
  app.add_option("--screenshot", window.screenshot, "write a picture of the window, then end")->type_name("FILE.png");
  app.add_flag("--scene-only", window.is_scene_only, "the picture contains the scene only, without panels and texts");
  add_text(app, "--after", "when, after joining [3s]", "TIME",
           [&window](const std::string& text) { window.after = parse_duration(text, "s"); });
  add_text(app, "--window-size", "of the window [1280x800 pixels]", "WxH",
           [&window](const std::string& text) { parse_size(text, window); });
  app.add_option("--molecules", window.molecules, "drawn as, also by M in the window [as last time, balls at first]")
      ->check(CLI::IsMember(MoleculeStyle::kShapeNames).description(""))
      ->type_name("balls|sticks|surface|ribbon");
  app.add_option("--molecule-colors", window.molecule_colors,
                 "property that sets the color, also by N [as last time, element at first]")
      ->check(CLI::IsMember(MoleculeStyle::kColorNames).description(""))
      ->type_name("element|chain|residue");
}

void add_run_options(CLI::App& app, ClientOptions& options) {
  app.add_option("--seed", options.seed, "of the simulated hand and links")
      ->check(CLI::NonNegativeNumber.description(""))
      ->capture_default_str();
  add_text(app, "--duration",
           "how long to run after joining, or after the start of a room whose hands begin together, e.g. 10s; default: "
           "until Ctrl-C",
           "TIME", [&options](const std::string& text) {
             options.duration = parse_duration(text, "s");
             if (*options.duration <= Duration{0}) throw std::invalid_argument("'" + text + "' must be above 0");
           });
  add_text(app, "--start-timeout",
           "with --duration: end with exit code 1 if a room whose hands begin together does not begin within this time "
           "[60s]",
           "TIME", [&options](const std::string& text) { options.start_timeout = parse_duration(text, "s"); });
  app.add_option("--rt-priority", options.realtime_priority,
                 "SCHED_FIFO priority of the haptic thread, 1 to 99; 0: normal scheduler")
      ->capture_default_str()
      ->check(CLI::Range(0, 99).description(""));
  app.add_option("--cpu", options.cpu, "pin the haptic thread to this CPU")
      ->type_name("N")
      ->check(CLI::Range(0, last_cpu()).description(""));
  add_text(
      app, "--keep-awake",
      "keep the haptic thread's processor from sleeping, by a thread of the lowest priority [auto]: where the "
      "machine is virtual and its kernel cannot, if the priority is granted and no container's quota would be used up; "
      "takes a processor's time from the host",
      "auto|on|off", [&options](const std::string& text) {
        options.keeps_awake = chosen<std::optional<bool>>(text, {{"auto", std::nullopt}, {"on", true}, {"off", false}});
      });
  app.add_flag("--insist-realtime", options.insists_on_realtime, "end with exit code 2 when a right is not granted");
  app.add_flag("--json", options.prints_json, "print one JSON object at the end instead of a status line each second");
  app.add_flag(
      "--commands", options.reads_commands,
      "read commands from stdin, one a line, and answer each by one line on stdout, a JSON object; nothing else "
      "is printed there. The commands are listed below; the end of stdin ends the program");
  app.add_flag("--verbose", options.is_verbose, "log the session's events to stderr");
  app.add_option("--trace", options.trace,
                 "write the time series of every haptic tick to this CSV file; in a window, of the first session")
      ->type_name("FILE.csv");
  app.add_option("--trace-every", options.trace_every, "only every n-th tick")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000).description(""));
}

void add_recording_options(CLI::App& app, ClientOptions& options) {
  app.add_option("--record", options.record,
                 "record device, tool, forces, faults and the link into this file (MCAP; tandem-replay reads it, and "
                 "--device replay:FILE moves the same hand again); in a window, the first session")
      ->type_name("FILE.mcap");
  app.add_option("--record-every", options.record_every, "only every n-th tick")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000).description(""));
  add_text(app, "--record-rotate-size", "begin another file after this size [MB]; 0: never [1000]", "MB",
           [&options](const std::string& text) {
             double megabytes = 0;
             if (!CLI::detail::lexical_cast(text, megabytes) || !(megabytes >= 0 && megabytes <= 1e6)) {
               throw std::invalid_argument("'" + text + "' must be a number from 0 to 1e6");
             }
             options.record_rotation.max_bytes = static_cast<std::uint64_t>(megabytes * 1e6);
           });
  add_text(app, "--record-rotate-age", "begin another file after this long; 0s: never [3600s]", "TIME",
           [&options](const std::string& text) { options.record_rotation.max_age = parse_duration(text, "s"); });
}

void check_links(const ClientOptions& options, const net::LinkParameters& link) {
  const std::string problem = link.problem();
  if (!problem.empty()) throw std::invalid_argument("simulated link: " + problem);
  if (options.io.client.session.state_over_tcp && link.spoils_datagrams()) {
    throw std::invalid_argument(
        "--transport tcp: over a stream nothing is lost, doubled or reordered; leave out --loss, --duplication and "
        "--reorder, or use --transport udp");
  }
}

std::string listed_commands() {
  std::string text =
      "Commands of --commands (POSE: the number of a kept pose, or its name; a field with blanks in double quotes):\n";
  for (const auto& [usage, purpose] : command_usages()) text += "  " + usage + ": " + purpose + "\n";
  return text;
}

/// Returns true if the command line contains no option that names or authenticates a server.
bool names_no_server(const CLI::App& app) {
  constexpr std::array kNaming{"--server", "--join", "--pin", "--ca", "--token", "--insecure"};
  return std::ranges::none_of(kNaming, [&app](const char* option) { return app.count(option) > 0; });
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

void apply_server(const std::string& text, ClientIoSettings& io) {
  const net::HostPort server = net::host_port_of(text);
  io.host = server.host;
  if (server.port) io.port = *server.port;
}

std::optional<ClientOptions> parse_client_options(int argc, const char* const* argv) {
  CLI::App app{
      "Joins a shared haptic scene with one device. Without --server, --join, --pin, --ca, --token and --insecure, a "
      "window offers scenes, files and servers.",
      "tandem-client"};
  app.footer(
      "Exit code: 0 done; 1 the session was lost, no state was received, a parameter, recording, trace or picture is "
      "incomplete, or a command of --commands failed; 2 bad set-up.\n\n" +
      listed_commands());
  ClientOptions options;
  net::LinkParameters link;
  SecurityOptions security;
  bool has_link = false;
  bool is_headless = false;
  DeviceCommandLine devices;
  add_session_options(app, options);
  add_security_options(app, security);
  add_deadband_option(app, options);
  devices.declare(app, options.device);
  add_workspace_options(app, options);
  add_nudge_option(app, options);
  add_stage_options(app, options.stage);
  add_set_option(app, options.sets);
  add_link_options(app, link, has_link);
  add_window_options(app, options.window, is_headless);
  add_run_options(app, options);
  add_recording_options(app, options);
  app.set_version_flag("--version", "tandem-client " TANDEM_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw std::invalid_argument(one_line(error.what()) + "; see --help");
    app.exit(error);
    return std::nullopt;
  }
  if (const auto cache = default_cache_directory(); !cache.empty()) {
    options.io.client.session.asset_store = disk_asset_store(cache / "assets");
  }
  options.window.is_open = !is_headless;
  if (options.reads_commands && options.prints_json) {
    throw std::invalid_argument(
        "--commands prints answers only on stdout: leave out --json; --record and --trace write files");
  }
  // Must be checked before any file or socket is opened: with a closed standard input, the next opened file would get
  // descriptor 0.
  if (options.reads_commands && fcntl(STDIN_FILENO, F_GETFD) < 0) {
    throw std::invalid_argument("--commands: the standard input is closed; give it a file, a pipe or /dev/null");
  }
  if (is_headless && !options.window.screenshot.empty()) {
    throw std::invalid_argument("--screenshot is of the window: leave out --headless");
  }
  if (is_headless && options.window.begins_guide) {
    throw std::invalid_argument("--guide is in the window: leave out --headless");
  }
  if (options.window.awaits_server && !options.window.begins_guide) {
    throw std::invalid_argument("--await-server is of the guide: add --guide");
  }
  options.device.seed = options.seed;
  options.device.realtime_priority = options.realtime_priority;
  options.window.has_start_screen = !is_headless && !options.reads_commands && names_no_server(app);
  options.second_device = devices.complete(app, options.device, !is_headless || options.reads_commands);
  if (!options.window.has_start_screen) apply_security(security, app.count("--role") > 0, options.io);
  if (has_link) {
    check_links(options, link);
    options.io.links = SimulatedLinks{link, link, options.seed};
  }
  return options;
}

}  // namespace tandem::client

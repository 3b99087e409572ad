#include "client/app/device_options.hpp"

#include <CLI/CLI.hpp>
#include <iostream>
#include <stdexcept>

#include "client/app/option_types.hpp"
#include "client/recording/recorded_hand.hpp"
#include "common/base/units.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::client {
namespace {

std::string listed_devices() {
  std::string text;
  for (const devices::DeviceKind& kind : devices::device_kinds()) {
    text.append(text.empty() ? "" : "; ").append(kind.name).append(": ").append(kind.description);
  }
  return text;
}

void add_device_options(CLI::App& app, devices::DeviceOptions& device, std::string& profile) {
  device.name = "auto";
  app.add_option("--device", device.name,
                 "device of the hand: " + listed_devices() +
                     "; auto: the first real one that is plugged in; when there is none, mouse in the window and with "
                     "--commands, sim with --headless or --hand")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "--profile", profile,
         "limits [N, N*m], axes, encoder steps [m, rad], mass [kg] and damping [N*s/m] of the device, or of the one "
         "that the simulated hand holds; a profile of devices/PROFILES.md or FILE.json; default: the device's own")
      ->type_name("NAME|FILE.json");
  app.add_option("--hand", device.hand,
                 "intended trajectory of the simulated hand: FILE.json or one of " + listed(devices::hand_path_names()))
      ->capture_default_str();
  add_text(app, "--hand-shift", "how much later than the room the simulated hand begins its path, 0s to 60s [0s]",
           "TIME", [&device](const std::string& text) {
             device.hand_shift = parse_duration(text, "s");
             if (device.hand_shift < Duration{0} || device.hand_shift > std::chrono::seconds(60)) {
               throw std::invalid_argument("'" + text + "' must be 0s to 60s");
             }
           });
  app.add_option("--motors", device.motors,
                 "of a simulated hand: a file or pipe to which each force is written as three doubles [N], as to "
                 "motors; a watchdog writes zero there when this program is stopped or killed")
      ->type_name("FILE");
  app.add_option("--control", device.control, "quantity of the handle that the cap of a spacemouse sets: rate or pose")
      ->capture_default_str()
      ->check(CLI::IsMember({"rate", "pose"}).description(""))
      ->type_name("rate|pose");
  app.add_option("--firmware", device.firmware,
                 "of a falcon: its maker's firmware file, loaded if the device has none yet")
      ->type_name("FILE");
  add_number(app, "--motor-counts", device.motor_counts_per_n_m, devices::kMinMotorCounts_per_n_m,
             devices::kMaxMotorCounts_per_n_m,
             "of a falcon: motor counts for a torque [counts/(N*m)]; calibrate with a weight", "COUNTS");
  app.add_option("--service", device.service, "of an inverse3: where its maker's service listens")
      ->capture_default_str()
      ->type_name("ADDRESS:PORT");
  app.add_option("--library", device.library,
                 "of forcedimension and openhaptics: the maker's shared library; default: as the system finds it")
      ->type_name("FILE");
  app.add_option("--rumble", device.rumble,
                 "of a mouse: the game pad whose rumble shows the force; auto: the first one found")
      ->capture_default_str()
      ->type_name("auto|off|/dev/input/eventN");
  devices::HandParameters& hand = device.hand_parameters;
  // The ranges are the same as in an experiment file (lab/experiment/experiment.cpp), so that values are valid in both.
  add_number(app, "--hand-mass", hand.mass_kg, 0.01, 10, "without the device [kg]", "KG");
  add_number(app, "--hand-stiffness", hand.stiffness_n_per_m, 0, 10000,
             "arm stiffness, towards the intended trajectory [N/m]", "N/M");
  add_number(app, "--hand-damping", hand.damping_n_s_per_m, 0, 1000, "arm damping [N·s/m]", "N*S/M");
  add_number(app, "--hand-tremor", hand.tremor_rms_n, 0, 10, "force around 9 Hz [N rms]", "N");
  add_number(app, "--hand-encoder-step", hand.encoder_step_m, 0, 0.01,
             "quantisation of the reported position, where coarser than the device's; 0: none [m]", "M");
}

void add_second_device_options(CLI::App& app, devices::DeviceOptions& second) {
  app.add_option(
         "--second-device", second.name,
         "device of your other hand, which has a tool of its own, as a second user of the room; --join admits both")
      ->type_name("NAME");
  app.add_option("--second-hand", second.hand, "as --hand, of a simulated second hand")->capture_default_str();
}

/// Returns the options of the second device. They are those of the first device, except for its name and its recorded
/// hand.
devices::DeviceOptions second_device(const devices::DeviceOptions& first, const devices::DeviceOptions& named) {
  if (named.name == first.name && named.name == "inverse3") {
    throw std::invalid_argument(
        "--second-device inverse3: its service would give both hands the same device; only one inverse3 a program");
  }
  devices::DeviceOptions second = first;
  second.name = named.name;
  second.recorded = named.recorded;
  second.hand = named.hand;
  second.profile = devices::find_device_profile(devices::find_device_kind(named.name).profile);
  return second;
}

/// Replaces the device "auto" by a real device and finds the profile. Called after parsing, so that --help and
/// --version work without a device file.
void complete_device(devices::DeviceOptions& device, const std::string& profile, bool has_hand, bool has_pointer) {
  const char* option = "--device: ";
  try {
    if (device.name == "auto") {
      const auto log = [](const std::string& note) { std::cerr << "tandem-client: " + note + "\n"; };
      device.name = devices::choose_device(!has_hand && profile.empty(), log);
      if (device.name == "sim" && has_pointer && !has_hand) device.name = "mouse";
    }
    const devices::DeviceKind& kind = devices::find_device_kind(device.name);
    option = "--profile: ";
    device.profile = devices::find_device_profile(profile.empty() ? kind.profile : profile);
  } catch (const std::exception& error) {
    throw std::invalid_argument(option + std::string(error.what()) + "; see --help");
  }
}

/// Replaces "replay:FILE" by the device "replay" with the hand that FILE has recorded.
void apply_recorded(devices::DeviceOptions& device) {
  constexpr std::string_view kReplay = "replay:";
  if (!device.name.starts_with(kReplay)) return;
  std::string why;
  device.recorded = read_recorded_hand(device.name.substr(kReplay.size()), why);
  if (!why.empty()) std::cerr << "tandem-client: warning: " + why + "\n";
  device.name = "replay";
}

}  // namespace

void DeviceCommandLine::declare(CLI::App& app, devices::DeviceOptions& first) {
  second_.name.clear();
  add_device_options(app, first, profile_);
  add_second_device_options(app, second_);
}

std::optional<devices::DeviceOptions> DeviceCommandLine::complete(const CLI::App& app, devices::DeviceOptions& first,
                                                                  bool has_pointer) {
  apply_recorded(first);
  complete_device(first, profile_, app.count("--hand") > 0, has_pointer);
  try {
    apply_recorded(second_);
    if (second_.name.empty()) return std::nullopt;
    return second_device(first, second_);
  } catch (const std::exception& error) {
    throw std::invalid_argument("--second-device: " + std::string(error.what()) + "; see --help");
  }
}

}  // namespace tandem::client

// What an experiment file says, checked: a scene, simulated hands, their links and stages, and one seed.
// Everything that happens in a trial follows from this; lab/README.md lists the fields.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/session.hpp"
#include "common/link.hpp"
#include "devices/device_profile.hpp"
#include "devices/sim/hand_path.hpp"
#include "server/room.hpp"

namespace tandem::lab {

/// One simulated person with device, client and link.
struct ExperimentUser {
  std::string name;
  UserRole role = UserRole::kManipulator;
  std::string hand_name = "rest";
  HandPath hand = named_hand_path("rest");
  HandParameters hand_parameters;                     ///< without the device
  DeviceProfile device = find_device_profile("sim");  ///< what the hand holds
  std::string stage = "late-pose";
  StateTransport transport = StateTransport::kUdp;
  LinkParameters up;
  LinkParameters down;
  Duration tick_phase{0};  ///< of its 1 kHz loop within the millisecond: a whole number of slots
};

struct Experiment {
  std::string name;
  std::string description;
  std::filesystem::path scene;  ///< an existing file
  Duration duration{from_seconds(10)};
  std::uint64_t seed = 1;
  Duration server_phase{0};                     ///< of the room's step, as tick_phase
  Duration sample_period{from_seconds(0.010)};  ///< of the CSV files
  std::vector<ExperimentUser> users;
};

/// Virtual time advances in these; loops with a period of 1 ms can be in one of four phases to each other.
inline constexpr Duration kSlot{from_seconds(0.00025)};
inline constexpr Duration kHapticPeriod{from_seconds(0.001)};

/// Reads an experiment file; relative paths in it start at its folder, a bare scene name at the shipped scenes.
/// Fails   std::invalid_argument naming file, field, value and remedy
Experiment load_experiment(const std::filesystem::path& file);
Experiment parse_experiment(std::string_view json, const std::string& origin, const std::filesystem::path& directory);

/// The file of a scene given by its path, relative to `directory`, or by the name of a shipped scene ("peg_in_hole").
/// Fails   SceneError (lists the shipped names)
std::filesystem::path scene_path(const std::string& scene, const std::filesystem::path& directory);

}  // namespace tandem::lab

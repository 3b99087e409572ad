// What an experiment file says, checked: a scene, simulated hands, their links, what stands between them and the
// scene, and one seed. Everything that happens in a trial follows from this; lab/README.md lists the fields.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/session/session.hpp"
#include "common/base/json.hpp"
#include "common/net/link.hpp"
#include "devices/device_profile.hpp"
#include "devices/sim/hand_path.hpp"
#include "lab/experiment/pipeline.hpp"
#include "server/room/room.hpp"

namespace tandem::lab {

/// As experiment files have it.
std::string_view role_name(server::UserRole role);

/// One simulated person with device, client and link.
struct ExperimentUser {
  std::string name;
  server::UserRole role = server::UserRole::kManipulator;
  std::string hand_name = "rest";
  devices::HandPath hand = devices::named_hand_path("rest");
  devices::HandParameters hand_parameters;                              ///< without the device
  devices::DeviceProfile device = devices::find_device_profile("sim");  ///< what the hand holds
  bool is_bounded = false;  ///< the device's workspace ends; whoever holds it looks at the tool and steers
  double motion_scale = 1;  ///< WorkspaceSettings::scale
  double pace = 1;          ///< of the hand's path: 2 is twice as fast
  Pipeline pipeline;        ///< between the server's state and the hand
  bool state_over_tcp = false;
  net::LinkParameters up;
  net::LinkParameters down;
  Duration tick_phase{0};  ///< of its 1 kHz loop within the millisecond: a whole number of slots
};

/// What has to happen for a trial to have succeeded, beyond that nobody lost the connection.
struct OutcomeRule {
  std::string body;
  double lifted_above_m = 0;           ///< over where it was at the start …
  std::string during;                  ///< … all through this phase of the first user's hand
  std::optional<Vec3> ends_at_W = {};  ///< counts instead of the two: where the body has to be when the trial ends
  double ends_within_m = 0;            ///< of it
};

struct Experiment {
  std::string name;
  std::string description;
  std::filesystem::path scene;        ///< an existing file
  boost::json::object scene_changes;  ///< what is different from the file: dotted names in it → values
  Duration duration{from_seconds(10)};
  std::uint64_t seed = 1;
  Duration server_phase{0};                     ///< of the room's step, as tick_phase
  Duration sample_period{from_seconds(0.010)};  ///< of the CSV files
  Pipeline pipeline;                            ///< of users that say nothing else
  net::LinkParameters link;                     ///< likewise, each way
  std::string assets = "here";                  ///< of asset_deliveries()
  std::string reference_stage;                  ///< of the run at zero delay that this one is held against
  std::optional<OutcomeRule> outcome;
  std::vector<ExperimentUser> users;

  /// Of any user: then the room limits its tools too.
  bool controls_passivity() const {
    return std::any_of(users.begin(), users.end(), [](const ExperimentUser& user) { return user.pipeline.passivity; });
  }
};

/// How users get the scene's assets. "here": they have them from the start, for a trial is about state. "fetched": over
/// their links after joining, as in life; "fetched-in-turn": likewise, each piece asked for once the one before is here.
std::vector<std::string_view> asset_deliveries();

/// Virtual time advances in these; loops with a period of 1 ms can be in one of four phases to each other.
inline constexpr Duration kSlot{from_seconds(0.00025)};
inline constexpr Duration kHapticPeriod{from_seconds(0.001)};
inline constexpr std::uint64_t kMaxSeeds = 1000;

/// A file as it was read: not checked beyond being an object, so that quantities can be set before it is.
struct ExperimentFile {
  std::string origin;               ///< for messages
  std::filesystem::path directory;  ///< where relative paths in it start
  boost::json::object document;
};
/// Fails   std::invalid_argument: cannot be read, not JSON, not an object
ExperimentFile read_experiment_file(const std::filesystem::path& file);

/// Checks one trial: the document with its quantities set. What only says which trials there are (`seeds`, `grid`) is
/// left alone.
/// Fails   std::invalid_argument naming file, field, value and remedy
Experiment parse_experiment(const ExperimentFile& file);
/// The same from text, and from a file; a bare scene name is one of the shipped scenes.
Experiment parse_experiment(std::string_view json, const std::string& origin, const std::filesystem::path& directory);
Experiment load_experiment(const std::filesystem::path& file);

/// Every field with its value, as an experiment file has it: parsed again it gives the same trial.
boost::json::object experiment_json(const Experiment& experiment);
/// One way of a link, as a file has it; its rtt_ms is twice the delay.
boost::json::object link_json(const net::LinkParameters& link);

/// The file of a scene given by its path, relative to `directory`, or by the name of a shipped scene ("peg_in_hole").
/// Fails   SceneError (lists the shipped names)
std::filesystem::path scene_path(const std::string& scene, const std::filesystem::path& directory);

/// Fails: std::invalid_argument when there are more manipulators than the scene has tools.
void check_manipulators(const Experiment& experiment, const server::LoadedScene& scene);

/// The text of the experiment's scene with its changes made.
/// Fails   std::invalid_argument: a change names a body that is not there, or goes through what has no fields
std::string scene_text(const Experiment& experiment);
/// The scene loaded from that. Fails: as scene_text(), SceneError
std::shared_ptr<const server::LoadedScene> load_experiment_scene(const Experiment& experiment,
                                                                 const server::SceneLoading& loading = {});

/// Round trip of a user's link, both ways together.
Duration round_trip_of(const ExperimentUser& user);

}  // namespace tandem::lab

// The validated content of an experiment file: a scene, simulated hands, their links, the pipeline between hand and
// scene, and a seed. Together they determine a trial completely. lab/EXPERIMENTS.md lists the fields.
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

/// Returns the name of a role in experiment files.
std::string_view role_name(server::UserRole role);

/// One simulated user with its device, client and link.
struct ExperimentUser {
  std::string name;
  server::UserRole role = server::UserRole::kManipulator;
  std::string hand_name = "rest";
  devices::HandPath hand = devices::named_hand_path("rest");
  devices::HandParameters hand_parameters;  ///< parameters of the user's hand without the device
  devices::DeviceProfile device = devices::find_device_profile("sim");  ///< the device that the hand holds
  /// true: the device's workspace is limited, and the simulated user corrects the hand's path by watching the displayed
  /// tool
  bool is_bounded = false;
  /// factor by which the user multiplies the scene's position scale (motion of the tool per motion of the hand); see
  /// WorkspaceSettings::scale
  double motion_scale = 1;
  double pace = 1;    ///< speed factor of the hand's path: 2 is twice as fast
  Pipeline pipeline;  ///< how the client computes the hand's force from the server's states
  bool state_over_tcp = false;
  net::LinkParameters up;
  net::LinkParameters down;
  /// time by which the ticks of the user's 1 kHz loop are later than whole milliseconds: a multiple of kSlot
  Duration tick_phase{0};
};

/// Condition for the success of a trial: either a body is lifted (`lifted_above_m`, `during`), or it reaches a position
/// (`ends_at_W`). In addition, all connections must last until the end of the trial.
struct OutcomeRule {
  std::string body;
  double lifted_above_m = 0;  ///< required height of the body above its start position, during the phase `during`
  std::string during;         ///< name of a phase of the first user's hand
  /// replaces `lifted_above_m` and `during`: required position of the body at the end of the trial
  std::optional<Vec3> ends_at_W = {};
  double ends_within_m = 0;  ///< tolerance of ends_at_W
};

struct Experiment {
  std::string name;
  std::string description;
  std::filesystem::path scene;        ///< path of an existing scene file
  boost::json::object scene_changes;  ///< changes to the scene file: maps dotted field names to values
  Duration duration{from_seconds(10)};
  std::uint64_t seed = 1;
  Duration server_phase{0};  ///< time by which the room's steps are later than whole milliseconds: a multiple of kSlot
  Duration sample_period{from_seconds(0.010)};  ///< sampling period of the CSV files
  Pipeline pipeline;                            ///< pipeline of users without a pipeline of their own
  net::LinkParameters link;                     ///< each direction of the link, for users without a link of their own
  std::string assets = "here";                  ///< delivery of assets: one of asset_deliveries()
  std::string reference_stage;                  ///< stage of the zero-delay run that this trial is compared with
  std::optional<OutcomeRule> outcome;
  std::vector<ExperimentUser> users;

  /// Returns whether any user has a passivity controller. If so, the room also limits the energy of its tools.
  bool controls_passivity() const {
    return std::any_of(users.begin(), users.end(), [](const ExperimentUser& user) { return user.pipeline.passivity; });
  }
};

/// Returns the ways in which users obtain the scene's assets:
/// * "here": present from the start, for trials that study only the exchange of states;
/// * "fetched": transferred over the user's link after joining, as in practice;
/// * "fetched-in-turn": like "fetched", but each piece is requested only after the previous piece has arrived.
std::vector<std::string_view> asset_deliveries();

/// Step of virtual time: a quarter of a haptic period. Two loops of 1 kHz can thus be offset from each other by 0,
/// 0.25, 0.5 or 0.75 ms.
inline constexpr Duration kSlot{from_seconds(0.00025)};
inline constexpr Duration kHapticPeriod{from_seconds(0.001)};
inline constexpr std::uint64_t kMaxSeeds = 1000;

/// An experiment file after parsing. The document is a JSON object whose fields are not yet checked, so that quantities
/// can be set before the full check.
struct ExperimentFile {
  std::string origin;               ///< file name, for error messages
  std::filesystem::path directory;  ///< base of relative paths
  boost::json::object document;
};
/// Reads a file without checking its fields.
/// Fails   std::invalid_argument: the file cannot be read, is not JSON, or is not an object
ExperimentFile read_experiment_file(const std::filesystem::path& file);

/// Checks the document of one trial, in which all quantities have been set. Fields that only define the set of trials
/// (`seeds`, `grid`) are ignored.
/// Fails   std::invalid_argument naming file, field, value and remedy
Experiment parse_experiment(const ExperimentFile& file);
/// Parse one trial from text and from a file. A scene name without a path refers to a shipped scene.
Experiment parse_experiment(std::string_view json, const std::string& origin, const std::filesystem::path& directory);
Experiment load_experiment(const std::filesystem::path& file);

/// Returns every field with its value in the format of an experiment file. Parsing the result gives the same trial.
boost::json::object experiment_json(const Experiment& experiment);
/// Returns the parameters of one direction of a link in the format of an experiment file. The field `rtt_ms` of this
/// format is twice the delay of a direction.
boost::json::object link_json(const net::LinkParameters& link);

/// Finds the file of a scene by its path, relative to `directory`, or by the name of a shipped scene ("peg_in_hole").
/// Fails   SceneError (lists the shipped names)
std::filesystem::path scene_path(const std::string& scene, const std::filesystem::path& directory);

/// Checks that the scene has a tool for every manipulator.
/// Fails   std::invalid_argument: there are more manipulators than tools in the scene
void check_manipulators(const Experiment& experiment, const server::LoadedScene& scene);

/// Returns the text of the experiment's scene file with the changes applied.
/// Fails   std::invalid_argument: a change names a body that does not exist, or a field of a value that has no fields
std::string scene_text(const Experiment& experiment);
/// Loads the scene from scene_text().
/// Fails   std::invalid_argument: see scene_text(); SceneError
std::shared_ptr<const server::LoadedScene> load_experiment_scene(const Experiment& experiment,
                                                                 const server::SceneLoading& loading = {});

/// Returns the round-trip delay of a user's link: the sum of the delays of both directions.
Duration round_trip_of(const ExperimentUser& user);

}  // namespace tandem::lab

// The complete record of a trial: source of metrics, result files and reports.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/haptics/haptic_core.hpp"
#include "client/session/session.hpp"
#include "common/base/histogram.hpp"
#include "common/base/tick_faults.hpp"
#include "common/net/link.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/virtual_network.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::lab {

/// One haptic tick of one user: the client's record and the true state of the simulated hand.
struct TickSample {
  Tick tick;
  Duration time{0};  ///< since the hands started
  int phase = -1;    ///< index into the hand path's phases(); −1: none
  Pose hand_D;       ///< true pose of the hand
  Twist hand_twist_D;
  Vec3 intended_D;  ///< intended position of the hand
  RigidState handle_W;
  Pose tool_W;             ///< newest from the server
  Wrench stage_D;          ///< on the hand, before the safety stages
  Wrench requested_D;      ///< on the hand, after the passivity controller, before safety stages and clamp
  Wrench displayed_D;      ///< on the hand
  Wrench server_wrench_W;  ///< on the hand, newest from the server
  Duration state_age{0};   ///< negative: no state yet
  Duration input_age{0};   ///< since the last arrival from this user at the server; 0 if unknown
  Duration round_trip{0};
  BodyId held_body;
  Vec3 view_W = Vec3::Zero();  ///< watched body as displayed to this user
  bool has_view = false;
  haptics::SafetyFaults safety_faults = 0;
  std::uint32_t server_tick_faults = 0;
  bool is_clamped = false;
};

/// Whether the room limited a tool's energy in the newest step known at this tick.
inline bool is_tool_energy_limited(const TickSample& tick) {
  return (tick.server_tick_faults & kFaultToolEnergyLimited) != 0;
}

/// Copies the tick's record; the hand's fields keep their defaults.
TickSample sample_of(const client::TickRecord& record);

/// Called for each tick of a moving hand, with the index of the user and of the hand path's phase.
using OnTick = std::function<void(std::size_t user, const client::TickRecord& record, int phase)>;

/// An input as used by the server.
struct AnsweredInput {
  Duration time{0};  ///< time of the first step that used it
  Tick tick;
  double taken_j = 0;  ///< energy_taken_j() after the last step that used it
};

/// Energy that a tool's coupling has put into the world, less the energy taken from it, plus its spring's energy [J].
double energy_taken_j(const physics::World& world, std::size_t tool);
/// Records the tool's answered input; call after each step of the room.
void note_answer(const server::Room& room, std::size_t tool, Duration time, std::vector<AnsweredInput>& answered);

struct UserTrace {
  ExperimentUser user;
  std::uint64_t hand_seed = 0;
  bool stayed_connected = true;
  std::string why_disconnected;
  std::vector<TickSample> ticks;
  std::vector<AnsweredInput> answered;  ///< since the hands started
  double energy_to_hand_j = 0;          ///< since the hands started
  double energy_from_hand_j = 0;
  double passivity_dissipated_j = 0;  ///< world joules, since the hands started; NaN: no passivity controller
  double hand_joules_per_world_joule = 1;
  client::SessionCounters session;
  net::LinkCounters link_up;  ///< datagrams
  net::LinkCounters link_down;
  TrafficCounters traffic;  ///< since the hands started
  // Counted since connecting:
  std::optional<Duration> local_after = {};       ///< client::Client::local_after()
  std::optional<Duration> full_local_after = {};  ///< client::Client::full_local_after()
  std::uint64_t stream_bytes = 0;                 ///< both directions
  Histogram state_waits;  ///< wait of the server's datagrams for the line; with fetched assets, until full_local_after
};

/// The bodies of the world at one time, in the order of the scene.
struct BodiesSample {
  Duration time{0};
  std::vector<Pose> X_WB;
  double field_energy_kj_per_mol = 0;
};

struct SessionTrace {
  std::vector<UserTrace> users;
  std::vector<std::string> body_names;
  std::vector<bool> body_can_move;
  std::vector<BodiesSample> bodies;         ///< every sample_period
  std::optional<std::size_t> watched_body;  ///< index into body_names, of the body of TickSample::view_W
  server::HubCounters hub;
  std::uint64_t room_steps = 0;
  TickFaults faults_seen = 0;
  Duration joined_after{0};  ///< virtual time from the first connection to the start of the hands
  std::string field_kernel;  ///< kernel of the molecular field; "": the scene has none
};

}  // namespace tandem::lab

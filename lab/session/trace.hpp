// The complete record of a trial. Metrics, result files and reports are computed from it.
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
  Duration time{0};  ///< time since the hands started
  int phase = -1;    ///< index into the phases() of the hand's path; −1: no phase
  Pose hand_D;       ///< true pose of the hand
  Twist hand_twist_D;
  Vec3 intended_D;  ///< intended position of the hand
  RigidState handle_W;
  Pose tool_W;             ///< newest tool pose received from the server
  Wrench stage_D;          ///< wrench on the hand from the stage, before the passivity controller and the safety stages
  Wrench requested_D;      ///< wrench on the hand after the passivity controller, before safety stages and clamp
  Wrench displayed_D;      ///< displayed wrench on the hand
  Wrench server_wrench_W;  ///< newest wrench on the hand received from the server
  Duration state_age{0};   ///< age of the newest state; negative: no state was received yet
  /// time since data of this client last arrived at the server; 0 if unknown, as in a live trial
  Duration input_age{0};
  Duration round_trip{0};
  BodyId held_body;
  Vec3 view_W = Vec3::Zero();  ///< position of the watched body as displayed to this user
  bool has_view = false;
  haptics::SafetyFaults safety_faults = 0;
  std::uint32_t server_tick_faults = 0;
  bool is_clamped = false;
};

/// Returns whether the room limited the energy of a tool in the newest step received at this tick.
inline bool is_tool_energy_limited(const TickSample& tick) {
  return (tick.server_tick_faults & kFaultToolEnergyLimited) != 0;
}

/// Converts the client's record of a tick. The fields about the simulated hand have their default values.
TickSample sample_of(const client::TickRecord& record);

/// Callback for each tick of a moving hand. `user` is the index of the user, `phase` the index of the phase of the
/// hand's path.
using OnTick = std::function<void(std::size_t user, const client::TickRecord& record, int phase)>;

/// An input that a step of the server has used.
struct AnsweredInput {
  Duration time{0};  ///< time of the first step that used it
  Tick tick;
  double taken_j = 0;  ///< value of energy_taken_j() after the last step of the server that used this input
};

/// Returns the energy that a tool's coupling has received from the hand, except for dissipation [J]. It is the energy
/// that the coupling has supplied to the world, minus the energy taken from the world, plus the energy stored in the
/// coupling's spring.
double energy_taken_j(const physics::World& world, std::size_t tool);
/// Appends the input that the tool's last step used. Must be called after each step of the room.
void note_answer(const server::Room& room, std::size_t tool, Duration time, std::vector<AnsweredInput>& answered);

struct UserTrace {
  ExperimentUser user;
  std::uint64_t hand_seed = 0;
  bool stayed_connected = true;
  std::string why_disconnected;
  std::vector<TickSample> ticks;
  std::vector<AnsweredInput> answered;  ///< inputs used by the server since the hands started
  double energy_to_hand_j = 0;          ///< work on the hand since the hands started
  double energy_from_hand_j = 0;
  /// energy withheld by the passivity controller since the hands started [world joules]; NaN: no controller
  double passivity_dissipated_j = 0;
  double hand_joules_per_world_joule = 1;
  client::SessionCounters session;
  net::LinkCounters link_up;  ///< counters of datagrams from the client to the server
  net::LinkCounters link_down;
  TrafficCounters traffic;  ///< traffic since the hands started
  // The following values count from the start of the connection.
  std::optional<Duration> local_after = {};  ///< time to a first local model (client::Client::local_after())
  /// time to a first local model with all assets (client::Client::full_local_after())
  std::optional<Duration> full_local_after = {};
  std::uint64_t stream_bytes = 0;  ///< bytes of the stream in both directions
  /// times for which the server's datagrams waited until the line was free; if assets are fetched, only datagrams until
  /// full_local_after count
  Histogram state_waits;
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
  std::vector<BodiesSample> bodies;         ///< one entry for every sample_period
  std::optional<std::size_t> watched_body;  ///< index into body_names; TickSample::view_W is the position of this body
  server::HubCounters hub;
  std::uint64_t room_steps = 0;
  TickFaults faults_seen = 0;
  Duration joined_after{0};  ///< virtual time from the first connection until the hands started
  std::string field_kernel;  ///< implementation ("kernel") of the molecular field; empty: the scene has no field
};

}  // namespace tandem::lab

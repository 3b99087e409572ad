// Everything that a trial leaves behind: what metrics, result files and reports are made from.
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

/// One haptic tick of one user, from the inside of the client and from the outside of the simulated hand.
struct TickSample {
  Tick tick;
  Duration time{0};  ///< since the hands started
  int phase = -1;    ///< index into the hand path's phases(); −1: none
  Pose hand_D;       ///< true pose of the hand
  Twist hand_twist_D;
  Vec3 intended_D;  ///< where the hand wants to be
  RigidState handle_W;
  Pose tool_W;             ///< newest of the server
  Wrench stage_D;          ///< on the hand, before the safety stages
  Wrench asked_D;          ///< on the hand, after the passivity controller, before safety stages and clamp
  Wrench displayed_D;      ///< on the hand
  Wrench server_wrench_W;  ///< on the hand, newest of the server
  Duration state_age{0};   ///< negative: no state yet
  Duration input_age{0};   ///< since something of this user last arrived at the server; 0 where that is not known
  Duration round_trip{0};
  BodyId held_body;
  Vec3 view_W = Vec3::Zero();  ///< where this user sees the watched body
  bool has_view = false;
  haptics::SafetyFaults safety_faults = 0;
  std::uint32_t server_tick_faults = 0;
  bool is_clamped = false;
};

/// The room held a tool back, in the newest step that this tick knew of.
inline bool is_tool_energy_limited(const TickSample& tick) {
  return (tick.server_tick_faults & kFaultToolEnergyLimited) != 0;
}

/// What the tick's record has of it; the hand's side is left at rest.
TickSample sample_of(const client::TickRecord& record);

/// Called for a tick of a moving hand, with the index of the user and of the hand path's phase.
using OnTick = std::function<void(std::size_t user, const client::TickRecord& record, int phase)>;

/// An input as the server took it.
struct AnsweredInput {
  Duration time{0};  ///< of the first step that used it
  Tick tick;
  double taken_j = 0;  ///< energy_taken_j() after the last step that did
};

/// What the coupling of a tool has put into the world, less what it took from there, with what its spring holds [J].
double energy_taken_j(const physics::World& world, std::size_t tool);
/// After a step of the room.
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
  // Since connecting.
  std::optional<Duration> local_after = {};       ///< client::Client::local_after()
  std::optional<Duration> full_local_after = {};  ///< client::Client::full_local_after()
  std::uint64_t stream_bytes = 0;                 ///< both ways
  Histogram state_waits;  ///< of the server's datagrams for the line; where assets are fetched, until full_local_after
};

/// The bodies of the world at one instant, in the order of the scene.
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
  std::optional<std::size_t> watched_body;  ///< index into body_names; which TickSample::view_W is of
  server::HubCounters hub;
  std::uint64_t room_steps = 0;
  TickFaults faults_seen = 0;
  Duration joined_after{0};  ///< virtual time from the first connection to the start of the hands
  std::string field_kernel;  ///< of the molecular field; "": the scene has none
};

}  // namespace tandem::lab

// State as the loops see it: plain structs of fixed size, so that a haptic tick or a room step can fill
// and read them without allocating. state_codec.hpp turns them into datagrams and back, on io threads.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>

#include "common/base/buttons.hpp"
#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/base/touch_exchange.hpp"

namespace tandem::proto {

/// Capacities of a room and of a state message; a scene that needs more is refused when it is loaded.
inline constexpr std::size_t kMaxBodies = 64;
inline constexpr std::size_t kMaxUsers = 16;

/// What a state message may say; a reader drops one that says more (DropReason::kNotFinite), so a writer keeps its
/// world inside. Far beyond any hand or tool, near enough that no sum or product of them overflows.
inline constexpr double kMaxPositionM = 1000.0;
inline constexpr double kMaxSpeedMPerS = 1000.0;
inline constexpr double kMaxTurnRadPerS = 1e4;
inline constexpr double kMaxForceN = 1e5;
inline constexpr double kMaxTorqueNM = 1e5;
inline constexpr double kMaxEnergyJ = 1e9;
/// Overlapping molecules have energies without bound; they are sent as this.
inline constexpr double kMaxFieldEnergyKjPerMol = 1e12;
/// Largest | |q| − 1 | of a rotation; a rotation is made unit length when it is read.
inline constexpr double kMaxQuaternionError = 1e-3;
/// Length of the translational and of the rotational part of a wave's sum, √W·s.
inline constexpr double kMaxWaveSum = 1e4;
/// Magnitude of each number of a soft contact's stiffness, N/m, N/rad or N·m/rad.
inline constexpr double kMaxContactStiffness = 1e9;
/// Least eigenvalue of a soft contact's stiffness, as a share of the largest: what rounding leaves of zero.
inline constexpr double kMaxNegativeStiffness = 1e-5;
/// Round trips and playout delays; longer ones are sent as this.
inline constexpr Duration kMaxDelay = std::chrono::seconds(10);
/// Largest time stamp and age, 73 years: four of them add up without overflow.
inline constexpr Duration kMaxTimestamp{std::int64_t{1} << 61U};

/// How a client bridges the delay, which says what its update tells and what the room does with it.
enum class ClientMode : std::uint32_t {
  kHandle = 0,      ///< the room couples the newest handle to its tool
  kLocalModel = 1,  ///< the client has a tool of its own; the room plays handles and tools out at a constant delay
  kWave = 2,        ///< force and velocity travel as wave variables
};

/// One haptic tick of a client, as the server is told.
struct ClientUpdate {
  Tick input_tick;
  RigidState handle;          ///< X_WH, V_WH after workspace mapping and clutch
  bool handle_valid = false;  ///< false: the device lost track of the hand
  std::uint32_t buttons = 0;  ///< bits of Button (common/base/buttons.hpp)
  LocalTime sent{};           ///< t1
  Step acknowledged_step;
  ServerTime acknowledged_sent{};
  Duration acknowledged_held{0};
  double energy_to_hand_j = 0;    ///< world joules, of the wrench before the safety stages
  double energy_from_hand_j = 0;  ///< likewise
  ClientMode mode = ClientMode::kHandle;
  Duration round_trip{0};  ///< as the client measured it, with what it waits before it uses what comes; 0: unknown
  Wrench wave;             ///< kWave: sum of the wave towards the tool, √W·s (wave_sum())
  Wrench on_hand_W;        ///< kLocalModel: what the hand is shown, about the handle, in W
};

struct BodyState {
  BodyId id;
  RigidState state;
  UserId held_by;
};
struct OtherUserState {
  UserId id;
  RigidState tool;
  BodyId holds;
  std::uint32_t tool_index = 0;  ///< of the scene's tools
  bool has_handle = false;       ///< one pulls the tool …
  RigidState handle;             ///< … this …
  Duration handle_age{0};        ///< … which was so long ago, about
  Wrench on_hand_W;              ///< what the hand was shown then, about the handle, in W
};

/// One step of a room as one user is told, without its bodies and the other users.
struct OwnUpdate {
  Step step;
  ServerTime stepped{};
  Tick answered_input;      ///< of which handle this step used exactly that; kLocalModel in a gap: which it stands for
  LocalTime echoed_sent{};  ///< t1, the client's own clock; 0: nothing received yet
  ServerTime received{};    ///< t2
  ServerTime sent{};        ///< t3
  RigidState tool;          ///< X_WT, V_WT
  Wrench wrench_on_hand_W;  ///< of the server's coupling, about the handle
  BodyId held_body;
  Pose X_BT;                      ///< the tool in the held body, while there is one
  std::uint32_t tick_faults = 0;  ///< bits of TickFaults (common/base/tick_faults.hpp)
  double energy_into_world_j = 0;
  double energy_from_world_j = 0;
  double field_energy_kj_per_mol = 0;
  Duration playout{0};       ///< present delay between a handle's arrival and its use; 0: the newest is used at once
  SoftContact soft_contact;  ///< of this user's tool or what it holds; trust_radius_m 0: none
  Wrench wave;               ///< kWave: sum of the wave towards the hand, √W·s
};

/// All of it: absolute, so that the newest one is enough.
struct ServerUpdate : OwnUpdate {
  boost::container::static_vector<BodyState, kMaxBodies> bodies;  ///< complete at the server; thinned on the wire
  boost::container::static_vector<OtherUserState, kMaxUsers> users;
};

}  // namespace tandem::proto

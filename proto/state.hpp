// State structs of fixed size for the real-time loops: a haptic tick or a room step fills and reads them without
// allocation. state_codec.hpp converts them to datagrams and back, on io threads.
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

/// Limits of the values in a state message. A reader drops a message that exceeds one (DropReason::kNotFinite), so a
/// writer keeps its world inside. They are far beyond any hand or tool, and small enough that no sum or product of them
/// overflows.
inline constexpr double kMaxPositionM = 1000.0;
inline constexpr double kMaxSpeedMPerS = 1000.0;
inline constexpr double kMaxTurnRadPerS = 1e4;
inline constexpr double kMaxForceN = 1e5;
inline constexpr double kMaxTorqueNM = 1e5;
inline constexpr double kMaxEnergyJ = 1e9;
/// Limit of a field energy; larger energies of overlapping molecules are clamped to it.
inline constexpr double kMaxFieldEnergyKjPerMol = 1e12;
/// Largest | |q| − 1 | of a rotation; readers normalise rotations.
inline constexpr double kMaxQuaternionError = 1e-3;
/// Limit of the translational and of the rotational part of a wave's sum [√W·s].
inline constexpr double kMaxWaveSum = 1e4;
/// Limit of each entry of a soft contact's stiffness [N/m, N/rad or N·m/rad].
inline constexpr double kMaxContactStiffness = 1e9;
/// Limit of a negative eigenvalue of a soft contact's stiffness, as a share of the largest one; rounding of zero.
inline constexpr double kMaxNegativeStiffness = 1e-5;
/// Limit of round trips and playout delays; longer ones are clamped to it.
inline constexpr Duration kMaxDelay = std::chrono::seconds(10);
/// Largest time stamp and age, 73 years: four of them add up without overflow.
inline constexpr Duration kMaxTimestamp{std::int64_t{1} << 61U};

/// Method by which a client bridges the delay. It determines the content of its updates and their use in the room.
enum class ClientMode : std::uint32_t {
  kHandle = 0,      ///< the room couples the newest handle to its tool
  kLocalModel = 1,  ///< the client has a tool of its own; the room plays handles and tools out at a constant delay
  kWave = 2,        ///< force and velocity travel as wave variables
};

/// One haptic tick of a client, as sent to the server.
struct ClientUpdate {
  Tick input_tick;
  RigidState handle;          ///< X_WH, V_WH after workspace mapping and clutch
  bool handle_valid = false;  ///< false: the device lost the hand's pose
  std::uint32_t buttons = 0;  ///< bits of Button (common/base/buttons.hpp)
  LocalTime sent{};           ///< t1
  Step acknowledged_step;
  ServerTime acknowledged_sent{};
  Duration acknowledged_held{0};
  double energy_to_hand_j = 0;  ///< cumulative work on the hand in world joules, by the wrench before the safety stages
  double energy_from_hand_j = 0;  ///< cumulative work taken from the hand, likewise
  ClientMode mode = ClientMode::kHandle;
  Duration round_trip{0};  ///< measured by the client, including its own playout delay; 0: unknown
  Wrench wave;             ///< kWave: sum of the wave towards the tool, √W·s (wave_sum())
  Wrench on_hand_W;        ///< kLocalModel: wrench displayed to the hand, about the handle, in W
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
  std::uint32_t tool_index = 0;  ///< index into the scene's tools
  bool has_handle = false;       ///< whether a handle pulls the tool
  RigidState handle;             ///< that handle
  Duration handle_age{0};        ///< approximate age of `handle`
  Wrench on_hand_W;              ///< wrench displayed to the hand then, about the handle, in W
};

/// One step of a room as sent to one user, without its bodies and the other users.
struct OwnUpdate {
  Step step;
  ServerTime stepped{};
  /// Input whose handle this step used; kLocalModel in a gap: input that the used handle represents.
  Tick answered_input;
  LocalTime echoed_sent{};  ///< t1, the client's own clock; 0: nothing received yet
  ServerTime received{};    ///< t2
  ServerTime sent{};        ///< t3
  RigidState tool;          ///< X_WT, V_WT
  Wrench wrench_on_hand_W;  ///< wrench of the server's coupling, about the handle
  BodyId held_body;
  Pose X_BT;                      ///< pose of the tool in the held body, while one is held
  std::uint32_t tick_faults = 0;  ///< bits of TickFaults (common/base/tick_faults.hpp)
  double energy_into_world_j = 0;
  double energy_from_world_j = 0;
  double field_energy_kj_per_mol = 0;
  Duration playout{0};  ///< present delay between a handle's arrival and its use; 0: the newest one is used at once
  SoftContact soft_contact;  ///< contact of this user's tool or its held body; trust_radius_m 0: none
  Wrench wave;               ///< kWave: sum of the wave towards the hand, √W·s
};

/// Complete update; state is absolute, so the newest one suffices.
struct ServerUpdate : OwnUpdate {
  boost::container::static_vector<BodyState, kMaxBodies> bodies;  ///< complete at the server; thinned on the wire
  boost::container::static_vector<OtherUserState, kMaxUsers> users;
};

}  // namespace tandem::proto

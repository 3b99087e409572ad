// State structs of fixed size. A haptic tick or a room step reads and writes them without allocation. state_codec.hpp
// converts them to datagrams and back; this is done on io threads.
#pragma once

#include <boost/container/static_vector.hpp>
#include <cstdint>

#include "common/base/buttons.hpp"
#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/base/touch_exchange.hpp"

namespace tandem::proto {

/// Maximum numbers of bodies and users in a room and in a state message. A scene that exceeds them is refused.
inline constexpr std::size_t kMaxBodies = 64;
inline constexpr std::size_t kMaxUsers = 16;

/// Limits of the values in a state message. A reader drops a message with a larger value (DropReason::kNotFinite), so a
/// writer must not send one. The limits are far above the values of any hand or tool. They are small enough that sums
/// and products do not overflow.
inline constexpr double kMaxPositionM = 1000.0;
inline constexpr double kMaxSpeedMPerS = 1000.0;
inline constexpr double kMaxTurnRadPerS = 1e4;
inline constexpr double kMaxForceN = 1e5;
inline constexpr double kMaxTorqueNM = 1e5;
inline constexpr double kMaxEnergyJ = 1e9;
/// Limit of a field energy. Overlapping molecules have larger energies, which are clamped to this limit.
inline constexpr double kMaxFieldEnergyKjPerMol = 1e12;
/// Maximum of | |q| − 1 | for a received rotation q; readers normalise q.
inline constexpr double kMaxQuaternionError = 1e-3;
/// Limit of a time-integrated wave variable [√W·s], both for its translational and for its rotational part.
inline constexpr double kMaxWaveSum = 1e4;
/// Limit of each entry of a soft contact's stiffness [N/m, N/rad or N·m/rad].
inline constexpr double kMaxContactStiffness = 1e9;
/// Largest permitted magnitude of a negative eigenvalue of a soft contact's stiffness, as a fraction of the largest
/// eigenvalue. Rounding errors can make an eigenvalue of zero slightly negative.
inline constexpr double kMaxNegativeStiffness = 1e-5;
/// Limit of round-trip times and playout delays; longer ones are clamped to this limit.
inline constexpr Duration kMaxDelay = std::chrono::seconds(10);
/// Maximum time stamp or age, 73 years. The sum of up to four of them does not overflow.
inline constexpr Duration kMaxTimestamp{std::int64_t{1} << 61U};

/// Method by which a client compensates for the network delay. It determines which fields the client's updates contain,
/// and how the room uses them.
enum class ClientMode : std::uint32_t {
  kHandle = 0,  ///< the room couples the newest received handle pose to its tool
  /// The client simulates a tool in its local model. The room plays out the received handles with a constant delay.
  kLocalModel = 1,
  kWave = 2,  ///< force and velocity are transmitted as wave variables
};

/// Input of one haptic tick of a client, as sent to the server.
struct ClientUpdate {
  Tick input_tick;
  RigidState handle;          ///< pose and velocity X_WH, V_WH after workspace mapping and clutch
  bool handle_valid = false;  ///< false: the device cannot measure the hand's pose
  std::uint32_t buttons = 0;  ///< pressed buttons, as bits of Button (common/base/buttons.hpp)
  LocalTime sent{};           ///< time of sending on the client's clock; time stamp t1 of the clock exchange
  Step acknowledged_step;
  ServerTime acknowledged_sent{};
  Duration acknowledged_held{0};
  /// Cumulative work done on the hand by the wrench that is requested before the safety stages [world J].
  double energy_to_hand_j = 0;
  double energy_from_hand_j = 0;  ///< cumulative work that the same wrench draws from the hand [world J]
  ClientMode mode = ClientMode::kHandle;
  Duration round_trip{0};  ///< measured by the client, including its playout delay; 0: unknown
  Wrench wave;       ///< in mode kWave: wave variable towards the tool, integrated over time [√W·s] (wave_sum())
  Wrench on_hand_W;  ///< in mode kLocalModel: wrench displayed to the hand, about the handle's origin, in W
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
  bool has_handle = false;       ///< whether a handle is coupled to the tool
  RigidState handle;             ///< pose and velocity of the coupled handle
  Duration handle_age{0};        ///< approximate age of `handle`
  Wrench on_hand_W;  ///< wrench displayed to the hand when `handle` was sampled, about the handle's origin, in W
};

/// Result of one room step for one user, without bodies and other users.
struct OwnUpdate {
  Step step;
  ServerTime stepped{};
  /// Tick of the input whose handle this step used. In mode kLocalModel, the handle is extrapolated while inputs are
  /// missing; this is then the tick to which it was extrapolated.
  Tick answered_input;
  LocalTime echoed_sent{};  ///< t1: send time of a client update, on the client's clock; 0: none received yet
  ServerTime received{};    ///< t2: reception of the same client update
  ServerTime sent{};        ///< time stamp t3: sending of this update
  RigidState tool;          ///< X_WT, V_WT of this user's tool
  Wrench wrench_on_hand_W;  ///< wrench of the server's coupling on the hand, about the handle's origin, in W
  BodyId held_body;
  Pose X_BT;                      ///< pose of the tool in the frame of the held body; valid while a body is held
  std::uint32_t tick_faults = 0;  ///< bits of TickFaults (common/base/tick_faults.hpp)
  double energy_into_world_j = 0;
  double energy_from_world_j = 0;
  double field_energy_kj_per_mol = 0;
  /// Current playout delay: time from the arrival of a handle pose to its use; 0: the newest pose is used at once.
  Duration playout{0};
  SoftContact soft_contact;  ///< contact of the user's tool, or of the body it holds; trust_radius_m = 0: no contact
  Wrench wave;               ///< in mode kWave: wave variable towards the hand, integrated over time [√W·s]
};

/// Complete update for one user. All values are absolute, not relative to earlier updates, so only the newest update is
/// needed.
struct ServerUpdate : OwnUpdate {
  /// All bodies of the room. A received message may lack some of them (thinning).
  boost::container::static_vector<BodyState, kMaxBodies> bodies;
  boost::container::static_vector<OtherUserState, kMaxUsers> users;
};

}  // namespace tandem::proto

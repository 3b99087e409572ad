// A room: one scene, one fixed-step loop and its users. A seat is the place of one user in a room.
//
//   io thread                             room thread (one at a time)
//   ─────────                             ───────────
//   RoomCommand  ──ring──▶              answer(): 1 apply commands
//   ClientUpdate ──mailbox per seat──▶            2 take each user's newest input, with which the driver of its
//                                                   mode sets the tool's handle (tool_driver.hpp)
//                                                 3 step the part of the world that hands feel, and account
//                                                   for the energy of each tool (tool_port.hpp)
//                ◀──mailbox── RoomUpdate              4 publish the updates for users
//                ◀──ring── RoomEvent   finish(): 5 step the rest of the world and the game, notify
//                                                   watchers, look ahead
//
// A seat may change users while values are still in mailboxes, so each update names its user. The io thread sets the
// time stamps `received` and `sent`.
//
// Besides the data of the diagram, the two threads exchange only soft-body offsets and the state of the game. During a
// step the room thread never waits, logs or allocates. The work of a step is bounded for any input: at most
// kMaxCommandsPerStep commands, and at most one grab or release per seat.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/haptics/passivity/tool_passivity_controller.hpp"
#include "common/realtime/mailbox.hpp"
#include "common/realtime/ring.hpp"
#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/goals/game.hpp"
#include "server/room/seat.hpp"
#include "server/room/server_world.hpp"
#include "server/room/soft_lattices.hpp"

namespace tandem::server {

/// Command from the io thread to the room, about a seat. Every command uses `index` and `user` of `seat`; only kJoin
/// uses the other fields of `seat`. kSetSignal comes from a source of signals. A source has no seat, so `user` serves
/// only for the recording.
struct RoomCommand {
  enum class Kind : std::uint8_t {
    kJoin,
    kLeave,
    kGrab,
    kRelease,
    kSetCoupling,
    kReset,
    kPlace,
    kStartLevel,
    kSetWeight,
    kSetSignal
  };
  Kind kind = Kind::kJoin;
  Seat seat = {};
  BodyId body = {};                               ///< kGrab: body to grab; invalid: nearest. kPlace: body to place
  std::uint32_t request = 0;                      ///< kGrab, kRelease: request number, copied into the event
  haptics::CouplingParameters coupling = {};      ///< kSetCoupling: new coefficients
  const haptics::CouplingLawInfo* law = nullptr;  ///< kSetCoupling; null: the law is unchanged
  std::uint32_t entries = 0;  ///< kSetCoupling: level for which the coupling was chosen, as GameStatus::entries; 0: any
  BodyId beside = {};         ///< kPlace: reference body
  Pose X_SB = {};             ///< kPlace: pose of `body` in the frame of `beside`
  std::uint8_t level = 0;     ///< kStartLevel: index of the level in the scene's game
  bool is_weightless = false;     ///< kSetWeight: true: gravity is off
  std::uint8_t signal = 0;        ///< kSetSignal: index of the signal of the game
  SignalValue signal_value = {};  ///< kSetSignal: new value of the signal
};

/// Event from the room to the io thread. kReturned concerns all users and has only the field `body`.
struct RoomEvent {
  enum class Kind : std::uint8_t { kGrabbed, kGrabRefused, kReleased, kReturned };
  Kind kind = Kind::kGrabbed;
  UserId user;
  BodyId body;
  std::uint32_t request = 0;
  physics::GrabResult refusal = physics::GrabResult::kGrabbed;  ///< kGrabRefused: reason of the refusal
};

/// State that a room publishes for its users after a step. Arrays are indexed by Seat::index.
struct RoomUpdate {
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;
  /// States of all users with tools. for_seat() removes the recipient's own state.
  boost::container::static_vector<proto::OtherUserState, proto::kMaxUsers> users;
  std::array<UserId, proto::kMaxUsers> user;  ///< user of the seat; invalid: the seat is free
  /// Number of grabs and releases served for the seat's user.
  std::array<std::uint64_t, proto::kMaxUsers> requests_served{};
  std::array<proto::OwnUpdate, proto::kMaxUsers> own;

  /// Returns the update for the user of one seat.
  proto::ServerUpdate for_seat(std::size_t seat) const;
};

/// Deformation of the scene's soft bodies, for display. For each body: the offsets of its proto::soft_lattice() points
/// from their rest positions.
using SoftOffsets = std::vector<std::vector<Vec3>>;

/// Largest number of commands applied in one step. Further commands remain in the ring until the next step.
inline constexpr int kMaxCommandsPerStep = 64;

/// Age at which an input becomes stale. From this age on, the tool does not follow the handle, because the hand may
/// have moved anywhere.
inline constexpr Duration kInputStaleAfter = std::chrono::milliseconds(115);

/// Time after the loss of a connection within which its user may rejoin. The state of a room after a crash is kept for
/// at least as long.
inline constexpr Duration kResumeWithin = std::chrono::minutes(15);

/// Time after resume() during which a tool and its held body are reserved for their previous user.
inline constexpr Duration kKeptFor = std::chrono::seconds(10);

/// Settings of a common start: the hands of all users of a room begin at the same time.
struct RoomStartSettings {
  std::size_t users = 0;                        ///< manipulators required for the start; 0: hands start independently
  Duration countdown{std::chrono::seconds(3)};  ///< time from the arrival of the last required manipulator to the start
};

struct RoomOptions {
  bool steps_soft_aside = false;        ///< whether soft bodies step on a separate thread, with identical results
  bool controls_tool_passivity = true;  ///< whether the energy of a tool is limited to the supply of its hand
  RoomStartSettings start{};            ///< settings of the common start, used by RoomSeats
};

/// State from which a room can be restored, for example after a crash of the server.
struct RoomState {
  /// A user's tool and its grip.
  struct Tool {
    std::uint8_t tool = 0;
    RigidState state;
    BodyId held;
    Pose X_BT;  ///< pose of the tool in the frame of the held body
  };
  /// Bodies that have moved from their start pose.
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;
  boost::container::static_vector<Tool, proto::kMaxUsers> tools;
  std::optional<GameStatus> game;  ///< none: the scene has no game
  std::vector<Vec3> soft_nodes_W;  ///< positions of the nodes of all soft bodies, body after body; empty: at rest
};

class Room;

/// Observer of a room's steps. It receives the inputs of each step in the order of their use, and the end of the step.
/// These data suffice to replay the step.
///
/// Thread  room: no allocation, lock or wait
class RoomWatcher {
 public:
  virtual ~RoomWatcher() = default;
  /// Called when a command is applied.
  virtual void on_command(const RoomCommand& command) noexcept = 0;
  /// Called after the last command of the step, before inputs are taken from the mailboxes.
  virtual void on_commands_done() noexcept {}
  /// Called when an input is taken from the mailbox of a seat.
  virtual void on_input(std::size_t seat, const proto::ClientUpdate& input) noexcept = 0;
  virtual void on_step(const Room& room, ServerTime now, TickFaults faults) noexcept = 0;
};

class Room {
 public:
  Room(RoomId id, std::string name, std::shared_ptr<const LoadedScene> scene, const RoomOptions& options = {});
  ~Room();

  RoomId id() const { return id_; }
  const std::string& name() const { return name_; }
  const LoadedScene& scene() const { return *scene_; }
  const std::shared_ptr<const LoadedScene>& shared_scene() const { return scene_; }
  Duration period() const { return period_; }
  const RoomStartSettings& start_settings() const { return start_settings_; }

  // Functions for the io thread.
  /// Posts a command. Returns false if 256 commands are queued already, which means that the room hangs or is flooded.
  bool post(const RoomCommand& command) { return commands_.push(command); }
  bool next_event(RoomEvent& event) { return events_.pop(event); }
  /// Returns the mailbox for the inputs of a seat (Seat::index), written by the io thread.
  realtime::Mailbox<proto::ClientUpdate>& input(std::size_t seat);
  /// Returns the mailbox of updates, written by the room thread.
  realtime::Mailbox<RoomUpdate>& output() { return output_; }
  /// Returns the mailbox of soft-body offsets. A room with soft bodies writes it at 20 Hz; another room never does.
  realtime::Mailbox<SoftOffsets>& soft_offsets() { return soft_offsets_; }

  /// Returns the game of the scene; null if it has none. The io thread reads the game's mailbox and events.
  Game* game() { return game_ ? &*game_ : nullptr; }
  const Game* game() const { return game_ ? &*game_ : nullptr; }

  /// Adds a watcher; call it before the first step. At most kMaxWatchers are allowed, and each must outlive the room's
  /// steps.
  void watch(RoomWatcher& watcher) { watchers_.push_back(&watcher); }
  /// Restores a saved state. Call it before the first step. Each saved tool is reserved for its user for the time
  /// kKeptFor, during which its held body does not move. A user who takes the tool in this time finds it at its saved
  /// pose, holding the body. Values out of range are ignored.
  void resume(const RoomState& state);

  // Functions for the room thread.
  /// Runs one fixed step: answer(), then finish(). `now` stamps the updates and does not affect the physics.
  void step(ServerTime now) noexcept;
  /// First part of a step: takes the inputs and publishes the updates for users (World::answer()).
  void answer(ServerTime now) noexcept;
  /// Second part of a step, followed by World::look_ahead(). Its faults are sent to users with the next step. Has no
  /// effect unless answer() was called before.
  void finish() noexcept;
  Step steps_done() const { return step_; }
  /// Returns whether a body can move; false for a static body and for an id that the scene does not contain.
  bool moves(BodyId body) const noexcept;
  /// Returns whether the loop may skip steps: the room has no user and no queued command, and the scene is at its start
  /// or has no automatic reset.
  bool is_idle() const;
  /// Returns whether no seat has a user.
  bool is_empty() const noexcept;
  /// Adds `faults` to the next updates. The thread that steps the room reports faults of its timing with it, for
  /// example kFaultOverrun.
  void report(TickFaults faults) { pending_faults_ |= faults; }
  /// Returns the number of events of the room and its game that were dropped because the queue to io was full (256
  /// events).
  std::uint64_t events_lost() const { return events_lost_ + (game_ ? game_->events_lost() : 0); }
  /// Returns the energy that the passivity controllers have dissipated in the tools' motion [J].
  double braked_j() const noexcept;
  const physics::World& world() const { return world_; }
  /// Writes the state for resume(). Allocates only in a scene with soft bodies, the first time that `state` is filled.
  void describe(RoomState& state) const noexcept;
  /// Returns the seat with this index; its user is invalid if the seat is free.
  const Seat& seat(std::size_t index) const;
  const RoomOptions& options() const { return options_; }
  /// Returns the tick of the input whose handle pulls the tool now; Tick{} if there is none.
  Tick answered(std::size_t tool) const;
  /// Returns the passivity controller of a seat. It has no effect in a room with controls_tool_passivity off.
  const haptics::ToolPassivityController& tool_passivity(std::size_t seat) const;

 private:
  struct User;

  /// Returns the simulated time of the completed steps.
  Duration time_done() const noexcept { return period_ * static_cast<Duration::rep>(step_.value); }
  void start_anew_when_left() noexcept;
  void apply_commands() noexcept;
  bool is_outdated(const RoomCommand& command) const noexcept;
  void apply(const RoomCommand& command) noexcept;
  void join(const Seat& seat) noexcept;
  void leave(User& user) noexcept;
  void open_port(User& user) noexcept;
  void resume_soft_bodies(std::span<const Vec3> nodes_W);
  void describe_soft_bodies(std::vector<Vec3>& nodes_W) const noexcept;
  void keep_left_things() noexcept;
  void serve_request(User& user, const RoomCommand& command) noexcept;
  void grab(User& user, BodyId body, std::uint32_t request) noexcept;
  void release(User& user, std::uint32_t request) noexcept;
  TickFaults receive_inputs() noexcept;
  TickFaults receive_input(User& user) noexcept;
  void receive_newest(User& user) noexcept;
  void follow_grab_button(User& user, std::uint32_t buttons) noexcept;
  void settle_tools() noexcept;
  std::uint32_t hands() const noexcept;
  void reset() noexcept;
  void place(BodyId body, const Pose& X_WB) noexcept;
  void publish_soft_offsets() noexcept;
  void describe_world(ServerTime now, TickFaults faults) noexcept;
  void describe_user(std::size_t seat, const proto::OwnUpdate& common) noexcept;
  void describe_tool(const User& user, proto::OwnUpdate& update) const noexcept;
  void emit(const RoomEvent& event) noexcept;

  RoomId id_;
  std::string name_;
  std::shared_ptr<const LoadedScene> scene_;
  RoomOptions options_;
  Duration period_;
  RoomStartSettings start_settings_;
  std::vector<BodyId> moving_bodies_;  ///< bodies whose states are part of each update
  physics::World world_;
  std::optional<Game> game_;
  realtime::Ring<RoomCommand> commands_{256};
  realtime::Ring<RoomEvent> events_{256};
  std::array<std::unique_ptr<User>, proto::kMaxUsers> users_;  ///< indexed by Seat::index
  realtime::Mailbox<RoomUpdate> output_;
  SoftLattices soft_lattices_;
  realtime::Mailbox<SoftOffsets> soft_offsets_;
  static constexpr std::size_t kMaxWatchers = 4;  // recorder, checkpoint, pose keeper, metrics
  boost::container::static_vector<RoomWatcher*, kMaxWatchers> watchers_;
  /// Restored tools that no user has taken yet, indexed by tool.
  std::array<std::optional<RoomState::Tool>, proto::kMaxUsers> left_;
  Step step_;
  std::int64_t steps_empty_ = 0;  ///< number of steps since the last user left
  bool is_as_at_start_ = true;
  TickFaults pending_faults_ = 0;
  TickFaults late_faults_ = 0;  ///< faults of the last finish(), which the next step reports
  /// Time and faults of the step for which answer() has run but finish() has not; none: there is no such step.
  std::optional<std::pair<ServerTime, TickFaults>> answered_;
  std::uint64_t events_lost_ = 0;
};

}  // namespace tandem::server

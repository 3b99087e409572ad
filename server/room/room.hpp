// A room: one scene, one fixed-step loop, its users.
//
//   io thread                             room thread (one at a time)
//   ─────────                             ───────────
//   RoomCommand  ──ring──▶              answer(): 1 apply commands
//   ClientUpdate ──mailbox per seat──▶            2 take each user's newest input, and let the driver of its mode set
//                                                   the handle of his tool (tool_driver.hpp)
//                                                 3 step the world as far as hands feel it; account for what each
//                                                   tool put into it (tool_port.hpp)
//                ◀──mailbox── RoomUpdate              4 publish what users are told
//                ◀──ring── RoomEvent   finish(): 5 step the rest of the world, tell watchers, look ahead
//
// A seat changes hands while values wait in mailboxes, so each update says whom it is for. The io side stamps
// `received` and `sent`.
//
// Nothing else crosses. The room thread never waits or logs in a step, and a step does a bounded amount of work
// whatever users send: at most kMaxCommandsPerStep commands, among them one grab or release a seat. It allocates
// nothing.
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
#include "server/room/seat.hpp"
#include "server/room/server_world.hpp"
#include "server/room/soft_lattices.hpp"

namespace tandem::server {

/// From io to the room, about a seat; only kJoin looks at more of it than `index` and `user`.
struct RoomCommand {
  enum class Kind : std::uint8_t { kJoin, kLeave, kGrab, kRelease, kSetCoupling, kReset, kPlace };
  Kind kind = Kind::kJoin;
  Seat seat;
  BodyId body = {};                               ///< kGrab; invalid: the nearest in reach. kPlace
  std::uint32_t request = 0;                      ///< kGrab, kRelease: carried back in the event
  haptics::CouplingParameters coupling = {};      ///< kSetCoupling
  const haptics::CouplingLawInfo* law = nullptr;  ///< kSetCoupling; null: it stays
  BodyId beside = {};                             ///< kPlace: of another body
  Pose X_SB = {};                                 ///< kPlace: of `body` in the frame of that one
};

/// From the room to io. kPutBack concerns all users, and only its `body` counts.
struct RoomEvent {
  enum class Kind : std::uint8_t { kGrabbed, kGrabRefused, kReleased, kPutBack };
  Kind kind = Kind::kGrabbed;
  UserId user;
  BodyId body;
  std::uint32_t request = 0;
  physics::GrabResult refusal = physics::GrabResult::kGrabbed;  ///< kGrabRefused
};

/// What a room's users are told of a step. Arrays are by Seat::index.
struct RoomUpdate {
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;
  /// All; nobody is told of himself.
  boost::container::static_vector<proto::OtherUserState, proto::kMaxUsers> users;
  std::array<UserId, proto::kMaxUsers> user;                      ///< whom the seat's is for; invalid: nobody
  std::array<std::uint64_t, proto::kMaxUsers> requests_served{};  ///< of his, kGrab and kRelease, so far
  std::array<proto::OwnUpdate, proto::kMaxUsers> own;

  /// As that user is told.
  proto::ServerUpdate of(std::size_t seat) const;
};

/// How the scene's soft bodies yield, for windows: of each, the offsets of proto::soft_lattice() from where it is at rest.
using SoftOffsets = std::vector<std::vector<Vec3>>;

/// More commands wait for the next step: io refills the ring while the room empties it.
inline constexpr int kMaxCommandsPerStep = 64;

/// Older input than this is not followed any more: the hand may be anywhere by then.
inline constexpr Duration kInputStaleAfter = std::chrono::milliseconds(115);

/// For so long a tool waits, with what it held, for the user who had it before the room was resumed.
inline constexpr Duration kKeptFor = std::chrono::seconds(10);

/// Whether the hands of a room begin together.
struct RoomStartSettings {
  std::size_t users = 0;                        ///< manipulators that must be there; 0: each hand begins by itself
  Duration countdown{std::chrono::seconds(3)};  ///< from the last one's arrival to the start
};

struct RoomOptions {
  bool steps_soft_aside = false;        ///< soft bodies by a thread of their own; the same bits
  bool controls_tool_passivity = true;  ///< a tool puts no more into the world than its user's hand put in
  RoomStartSettings start{};            ///< for RoomSeats
};

/// Where everything is, for a room that goes on from there: after a crash of the server, say.
struct RoomState {
  /// One that a user has.
  struct Tool {
    std::uint8_t tool = 0;
    RigidState state;
    BodyId held;
    Pose X_BT;  ///< in what it holds
  };
  boost::container::static_vector<proto::BodyState, proto::kMaxBodies> bodies;  ///< not where the scene starts them
  boost::container::static_vector<Tool, proto::kMaxUsers> tools;
  std::vector<Vec3> soft_nodes_W;  ///< of all soft bodies in their order; none: as the scene starts them
};

class Room;

/// Sees what each step uses, in that order, and when it is done: enough to do the same again.
///
/// Thread  the room's: no allocation, lock or wait
class RoomWatcher {
 public:
  virtual ~RoomWatcher() = default;
  /// A command is applied.
  virtual void on_command(const RoomCommand& command) noexcept = 0;
  /// All commands of the step have been; next, inputs are taken out of the mailboxes.
  virtual void on_commands_done() noexcept {}
  /// An input is taken.
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

  // io side
  /// False when 256 commands are waiting: the room is stuck or flooded.
  bool post(const RoomCommand& command) { return commands_.push(command); }
  bool next_event(RoomEvent& event) { return events_.pop(event); }
  /// By Seat::index; io writes.
  realtime::Mailbox<proto::ClientUpdate>& input(std::size_t seat);
  /// The room writes.
  realtime::Mailbox<RoomUpdate>& output() { return output_; }
  /// Of a room with soft bodies, 20 times a second; else never anything.
  realtime::Mailbox<SoftOffsets>& soft_offsets() { return soft_offsets_; }

  /// Before the first step, at most kMaxWatchers; they outlive the room's steps.
  void watch(RoomWatcher& watcher) { watchers_.push_back(&watcher); }
  /// Before the first step: things are there and move so. Who takes a tool of then within kKeptFor has it where it was, and in
  /// his hand what it held; until then that hangs where it was. What is out of range is left as the scene says.
  void resume(const RoomState& state);

  // room side
  /// One fixed step at `now` (stamps updates; does not change the physics): answer(), then finish().
  void step(ServerTime now) noexcept;
  /// What users wait for: their inputs are taken, and the outputs are there (World::answer()).
  void answer(ServerTime now) noexcept;
  /// The rest of the step, whose faults users are told with the next one; and what can be found of that (World::look_ahead()).
  /// Does nothing without an answer() before.
  void finish() noexcept;
  Step steps_done() const { return step_; }
  /// A static body, and one that the scene lacks, do not.
  bool moves(BodyId body) const noexcept;
  /// Nobody is here or has asked to come, and all is as the scene says, or stays as it was left: a step would change
  /// nothing that anybody could miss.
  bool is_idle() const;
  /// Nobody is here.
  bool is_empty() const noexcept;
  /// Adds `faults` to what the next updates report (the loop's own, e.g. kFaultOverrun).
  void report(TickFaults faults) { pending_faults_ |= faults; }
  /// Events that found no place: io has not taken any for 256 of them.
  std::uint64_t events_lost() const { return events_lost_; }
  /// What the passivity controllers of its tools took out of their motion.
  double braked_j() const noexcept;
  const physics::World& world() const { return world_; }
  /// For resume(). Without allocation where `state` has been here before, or the scene has no soft bodies.
  void describe(RoomState& state) const noexcept;
  /// Who has the seat; invalid: nobody.
  const Seat& seat(std::size_t index) const;
  const RoomOptions& options() const { return options_; }
  /// The newest input that moves a tool; Tick{} without one.
  Tick answered(std::size_t tool) const;
  /// Of a seat; without effect in a room that does not control the passivity of tools.
  const haptics::ToolPassivityController& tool_passivity(std::size_t seat) const;

 private:
  struct User;

  /// Time as the physics knows it.
  Duration time_done() const noexcept { return period_ * static_cast<Duration::rep>(step_.value); }
  void start_anew_when_left() noexcept;
  void apply_commands() noexcept;
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
  TickFaults take_inputs() noexcept;
  TickFaults take_input(User& user) noexcept;
  void take_newest(User& user) noexcept;
  void follow_grab_button(User& user, std::uint32_t buttons) noexcept;
  void settle_tools() noexcept;
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
  std::vector<BodyId> moving_bodies_;  ///< those that updates tell of
  physics::World world_;
  realtime::Ring<RoomCommand> commands_{256};
  realtime::Ring<RoomEvent> events_{256};
  std::array<std::unique_ptr<User>, proto::kMaxUsers> users_;  ///< by Seat::index
  realtime::Mailbox<RoomUpdate> output_;
  SoftLattices soft_lattices_;
  realtime::Mailbox<SoftOffsets> soft_offsets_;
  static constexpr std::size_t kMaxWatchers = 4;  // a recorder, a checkpoint, a keeper of poses, metrics
  boost::container::static_vector<RoomWatcher*, kMaxWatchers> watchers_;
  std::array<std::optional<RoomState::Tool>, proto::kMaxUsers> left_;  ///< by tool: of resume(), nobody has it yet
  Step step_;
  std::int64_t steps_empty_ = 0;  ///< since the last user left
  bool is_as_at_start_ = true;
  bool is_answered_ = false;  ///< a step is, and not finished
  TickFaults pending_faults_ = 0;
  TickFaults late_faults_ = 0;  ///< of the last finish(): users are told with the next step
  ServerTime answered_{};       ///< when the step was that is to be finished, and its faults
  TickFaults answered_faults_ = 0;
  std::uint64_t events_lost_ = 0;
};

}  // namespace tandem::server

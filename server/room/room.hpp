// A room: one scene, one fixed-step loop, its users.
//
//   io thread                             room thread (one at a time)
//   ─────────                             ───────────
//   RoomCommand  ──ring──▶                step(): 1 apply commands
//   ClientUpdate ──mailbox per slot──▶            2 take each user's newest input, or play it out (input_playout.hpp)
//                ◀──mailbox per slot── UserUpdate     3 step the world, and see what each tool put into it
//                ◀──ring── RoomEvent              4 publish one update a user
//
// A slot changes hands while values wait in its mailboxes, so each update says whom it is for. The io side stamps
// `received` and `sent`.
//
// Nothing else crosses. The room thread never waits or logs in step(), and a step does a bounded amount of work
// whatever users send: at most kMaxCommandsPerStep commands, among them one grab or release a slot. It allocates
// nothing, except where the world itself changes: joins, leaves, grabs, releases and first contacts let Bullet grow.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/haptics/passivity/tool_passivity_controller.hpp"
#include "common/physics/joints/delayed_joint.hpp"
#include "common/realtime/mailbox.hpp"
#include "common/realtime/ring.hpp"
#include "proto/state.hpp"
#include "server/assets/scene_file.hpp"
#include "server/physics/server_world.hpp"
#include "server/room/input_playout.hpp"
#include "server/room/wave_hand.hpp"

namespace tandem::server {

enum class UserRole : std::uint8_t { kManipulator, kObserver };

/// From io to the room. `slot` is the user's place in the room's fixed arrays.
struct RoomCommand {
  enum class Kind : std::uint8_t { kJoin, kLeave, kGrab, kRelease, kSetCoupling };
  Kind kind = Kind::kJoin;
  std::uint8_t slot = 0;
  UserId user;
  UserRole role = UserRole::kObserver;   ///< kJoin
  std::uint8_t tool = 0;                 ///< kJoin of a manipulator
  bool leaves_gaps = false;              ///< kJoin: between inputs the handle goes on as it last moved
  BodyId body;                           ///< kGrab; invalid: the nearest in reach
  std::uint32_t request = 0;             ///< kGrab, kRelease: carried back in the event
  haptics::CouplingParameters coupling;  ///< kSetCoupling
};

/// From the room to io.
struct RoomEvent {
  enum class Kind : std::uint8_t { kGrabbed, kGrabRefused, kReleased };
  Kind kind = Kind::kGrabbed;
  std::uint8_t slot = 0;
  UserId user;
  BodyId body;
  std::uint32_t request = 0;
  physics::GrabResult refusal = physics::GrabResult::kGrabbed;  ///< kGrabRefused
};

/// What a slot's user is told after a step.
struct UserUpdate {
  UserId user;                        ///< whom it is for
  std::uint64_t requests_served = 0;  ///< kGrab and kRelease of this user that the room has served so far
  proto::ServerUpdate update;
};

/// One user's two mailboxes.
struct UserSlot {
  realtime::Mailbox<proto::ClientUpdate> input;  ///< io writes, room reads
  realtime::Mailbox<UserUpdate> output;          ///< room writes, io reads
};

/// More commands wait for the next step: io refills the ring while the room empties it.
inline constexpr int kMaxCommandsPerStep = 64;

/// Older input than this is not followed any more: the hand may be anywhere by then.
inline constexpr Duration kInputStaleAfter = std::chrono::milliseconds(100);

/// Of a user that leaves gaps on purpose the handle is extrapolated for so long: the longest such gap (kDeadbandFloor),
/// and what the network adds to it.
inline constexpr Duration kExtrapolatedFor = std::chrono::milliseconds(15);

/// After another user's hand was on the same body, it counts as shared for so long: hands that touch it in turns do not
/// switch what joins them.
inline constexpr Duration kSharedFor = std::chrono::milliseconds(500);

struct RoomOptions {
  SoftStepping soft_stepping = SoftStepping::kInline;
  bool controls_tool_passivity = true;  ///< a tool puts no more into the world than its user's hand put in
};

class Room {
 public:
  Room(RoomId id, std::string name, std::shared_ptr<const LoadedScene> scene, const RoomOptions& options = {});

  RoomId id() const { return id_; }
  const std::string& name() const { return name_; }
  const LoadedScene& scene() const { return *scene_; }
  Duration period() const { return period_; }

  // io side
  /// False when 256 commands are waiting: the room is stuck or flooded.
  bool post(const RoomCommand& command) { return commands_.push(command); }
  bool next_event(RoomEvent& event) { return events_.pop(event); }
  UserSlot& slot(std::size_t index) { return *slots_[index]; }

  // room side
  /// One fixed step at `now` (stamps updates; does not change the physics).
  void step(ServerTime now) noexcept;
  Step steps_done() const { return step_; }
  /// Adds `faults` to what the next updates report (the loop's own, e.g. kFaultOverrun).
  void report(TickFaults faults) { pending_faults_ |= faults; }
  /// Events that found no place: io has not taken any for 256 of them.
  std::uint64_t events_lost() const { return events_lost_; }
  const physics::World& world() const { return world_; }
  /// The newest input that moves a tool; Tick{} without one.
  Tick answered(std::size_t tool) const;
  /// Of the user in the slot; without effect in a room that does not control the passivity of tools.
  const haptics::ToolPassivityController& tool_passivity(std::size_t slot) const {
    return bridges_[slot]->tool_passivity;
  }

 private:
  struct Member {
    UserId user;  ///< invalid: the slot is free
    UserRole role = UserRole::kObserver;
    std::uint8_t tool = 0;
    bool leaves_gaps = false;
    proto::ClientUpdate newest;
    Step input_seen_at;  ///< step in which `newest` arrived
    bool has_input = false;
    bool grab_button = false;
    bool is_driven = false;       ///< its tool follows a handle
    bool has_left_a_gap = false;  ///< between the last two inputs there were ticks that did not come
    Tick answered;                ///< whose handle is in use
    physics::JointShare joint_share;
    Step shared_until;         ///< the body that the tool has a hand on counts as shared
    Duration slowest_loop{0};  ///< of all who share a body with this user
    double weight_wanted = 0;  ///< of the held body, for its copy to bear: 1 all
    Step weight_wanted_since;
    physics::WeightShare weight;
    std::uint64_t requests_served = 0;

    bool is_manipulator() const { return user.is_valid() && role == UserRole::kManipulator; }
    bool is_in(proto::ClientMode mode) const { return is_manipulator() && has_input && newest.mode == mode; }
  };
  /// What bridges a slot's delay; large, so made once.
  struct Bridge {
    explicit Bridge(double step_s) : playout(step_s) {}

    InputPlayout playout;  ///< ClientMode::kLocalModel
    WaveHand wave;         ///< ClientMode::kWave
    haptics::ToolPassivityController tool_passivity;
  };

  /// Time as the physics knows it.
  Duration time_done() const noexcept { return period_ * static_cast<Duration::rep>(step_.value); }
  Duration input_age(const Member& member) const noexcept {
    return period_ * static_cast<Duration::rep>(step_.value - member.input_seen_at.value);
  }
  void apply_commands() noexcept;
  void apply(const RoomCommand& command) noexcept;
  void join(const RoomCommand& command) noexcept;
  void leave(std::size_t slot) noexcept;
  void serve_request(const RoomCommand& command) noexcept;
  void grab(std::size_t slot, BodyId body, std::uint32_t request) noexcept;
  void release(std::size_t slot, std::uint32_t request) noexcept;
  TickFaults take_inputs() noexcept;
  TickFaults take_input(std::size_t slot) noexcept;
  void take_newest(std::size_t slot) noexcept;
  TickFaults limit_tool(std::size_t slot) noexcept;
  void drive_tool(std::size_t slot) noexcept;
  void pull_to(std::size_t slot, const RigidState& handle) noexcept;
  void let_tool_be(std::size_t slot) noexcept;
  void play_out(std::size_t slot) noexcept;
  void move_by_wave(std::size_t slot) noexcept;
  void settle_waves() noexcept;
  void settle_tool_passivity() noexcept;
  void join_copies(std::size_t slot, const PlayedInput& played) noexcept;
  bool is_shared(BodyId body, std::size_t tool) const noexcept;
  Duration slowest_loop(std::size_t slot) const noexcept;
  std::size_t holders_of(BodyId body) const noexcept;
  double weight_on_copy(Member& member, BodyId held) const noexcept;
  void follow_grab_button(std::size_t slot, bool is_down) noexcept;
  void describe_world(ServerTime now, TickFaults faults) noexcept;
  void publish_to(std::size_t slot) noexcept;
  void describe_tool(std::size_t slot, proto::ServerUpdate& update) const noexcept;
  void emit(const RoomEvent& event) noexcept;

  RoomId id_;
  std::string name_;
  std::shared_ptr<const LoadedScene> scene_;
  Duration period_;
  bool controls_tool_passivity_;
  physics::World world_;
  realtime::Ring<RoomCommand> commands_{256};
  realtime::Ring<RoomEvent> events_{256};
  std::array<std::unique_ptr<UserSlot>, proto::kMaxUsers> slots_;
  std::array<Member, proto::kMaxUsers> members_{};
  std::array<std::unique_ptr<Bridge>, proto::kMaxUsers> bridges_;
  std::array<std::uint32_t, proto::kMaxBodies> hands_{};  ///< World::hands_on() of the last step
  std::array<bool, proto::kMaxUsers> has_grabbed_{};      ///< or released, in this step; outlives a change of users
  std::vector<BodyId> moving_bodies_;                     ///< those that updates tell of
  proto::ServerUpdate common_;                            ///< of this step: what all users are told alike
  haptics::CouplingParameters coupling_;                  ///< as last set
  Step step_;
  TickFaults pending_faults_ = 0;
  std::uint64_t events_lost_ = 0;
};

}  // namespace tandem::server

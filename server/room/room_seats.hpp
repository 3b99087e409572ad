// The io thread's record of a room: seats, tools, user ids, and the coupling in force.
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string_view>

#include "common/base/ids.hpp"
#include "common/net/token_bucket.hpp"
#include "server/room/room.hpp"
#include "server/room/room_start.hpp"

namespace tandem::server {

/// Rate limit of a room's resets: one per second, with bursts of two.
inline constexpr net::Rate kResetRate{1, 2};

/// Limit of the sources of signals of a room.
inline constexpr std::size_t kMaxSignalSources = 8;

/// Assigns the seats of one room, and posts the commands of their users to the room's loop.
///
/// Thread  io. A room thread that helps io with sending calls const members and on_update() at the same time as io, but
///         on_update() for other seats than io.
class RoomSeats {
 public:
  explicit RoomSeats(Room& room);

  Room& room() const { return room_; }
  RoomStart& start() { return start_; }
  const RoomStart& start() const { return start_; }
  /// Returns the coupling as set by the scene file, a level of the game or the operator.
  const physics::SceneCoupling& coupling() const { return coupling_; }
  /// Returns the coupling for the seat's tool and its held body (common/physics/coupling_in_force.hpp).
  haptics::CouplingParameters coupling_in_force(const Seat& seat) const;

  /// Assigns a free seat, and to a manipulator also a free tool. Returns nothing if the limits of the scene are
  /// reached.
  /// In      leaves_gaps  true: the user's client suppresses inputs that can be extrapolated (deadband)
  ///         device_bounds  largest coupling that this user's device supports, in device newtons and metres
  ///         user_name  name of the user, for recordings
  ///         tool  tool that the user had before a resume; it is assigned if it is free
  std::optional<Seat> allocate(UserRole role, bool leaves_gaps = false,
                               const haptics::CouplingParameters& device_bounds = haptics::kNoCouplingBounds,
                               std::string_view user_name = "", std::optional<std::uint8_t> tool = std::nullopt);
  /// Registers a new source of signals. Returns its entry, which has a user id but occupies no seat; none if the room
  /// already has kMaxSignalSources sources. leave() removes the entry.
  std::optional<Seat> add_source(std::string_view name);
  /// Posts a value of a signal. Returns false if the room's queue is full.
  bool set_signal(const Seat& source, std::uint8_t signal, const SignalValue& value);
  /// Returns whether allocate() would succeed now for this role; for a source of signals, whether add_source() would.
  bool has_place(UserRole role) const;
  /// Releases a seat. If its user is the operator, the coupling of the scene or of the current level is restored.
  void leave(const Seat& seat);
  bool has_operator() const;
  void set_coupling(const Seat& seat, const haptics::CouplingParameters& parameters);
  /// Sets the coupling law of the room.
  /// In      law  must be a law that the scene permits (haptics::law_change_problem())
  void set_law(const Seat& seat, const haptics::CouplingLawInfo& law);
  /// Moves all bodies back to their start (World::return_all()). Returns false, without effect, if the room's queue is
  /// full or kResetRate is exceeded. The rate is limited because each reset sends an event per moving body to every
  /// user.
  bool reset(const Seat& seat, LocalTime now);
  /// Records the coupling of a new level of the game. The room has already applied this coupling. It discards commands
  /// with couplings that were chosen for an earlier level.
  /// In      entries  count of entered levels (GameStatus::entries), which identifies the level
  void follow_level(const physics::SceneCoupling& coupling, std::uint32_t entries);
  /// Posts a command for the game of the room. Returns false if the room's queue is full.
  bool play(const Seat& seat, RoomCommand command) { return place(seat, command); }
  /// Posts a command of a user to the room, for example to move a body to a pose.
  /// In      placing  command to post; its `seat` is replaced by the argument `seat`
  /// Out     false: the room's queue is full
  bool place(const Seat& seat, RoomCommand placing);
  /// Posts a grab. Returns false, without effect, if the room's queue is full, or if the last request of this seat is
  /// not served yet (see on_update()). A single user can thus not fill the shared queue. If false is returned, the
  /// caller must notify the user.
  bool grab(const Seat& seat, BodyId body, std::uint32_t request);
  bool release(const Seat& seat, std::uint32_t request);
  /// Copies the number of served requests and the held body of the seat's user from an update. Every update repeats
  /// them, so a lost event causes no lasting error.
  void on_update(const Seat& seat, const RoomUpdate& update);
  /// Posts again the commands that did not fit into the room's queue.
  void flush();

 private:
  /// Returns the number of occupied seats of the kind that `role` needs: those with a tool, or those without.
  std::size_t count(UserRole role) const;
  std::optional<std::uint8_t> free_tool(std::optional<std::uint8_t> wanted) const;
  static void set_name(Seat& seat, std::string_view name);
  void post_coupling(const Seat& seat);
  void post_surely(const RoomCommand& command);
  bool post_request(const RoomCommand& command);

  Room& room_;
  RoomStart start_;
  physics::SceneCoupling coupling_;
  physics::SceneCoupling of_level_;  ///< coupling when no operator sets one: that of the scene or of the current level
  std::array<std::optional<Seat>, proto::kMaxUsers> seats_{};
  std::array<BodyId, proto::kMaxUsers> held_{};              ///< body held by the seat's tool, indexed by seat
  std::array<std::uint64_t, proto::kMaxUsers> requested_{};  ///< number of grabs and releases since the user joined
  std::array<std::uint64_t, proto::kMaxUsers> served_{};
  /// Level for which new couplings are chosen, as GameStatus::entries; 0: they hold for any level.
  std::uint32_t entries_ = 0;
  std::uint32_t last_user_ = 0;
  std::size_t sources_ = 0;  ///< number of sources of signals
  net::TokenBucket resets_{kResetRate};
  /// Commands that did not fit into the room's queue and must not be lost. Their number is bounded, because a room with
  /// many of them accepts no new users.
  std::deque<RoomCommand> waiting_;
};

}  // namespace tandem::server

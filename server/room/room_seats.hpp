// Who sits where in a room, as the io thread knows it: seats, tools, user ids, and the coupling in force.
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

/// Of one room, that are granted.
inline constexpr net::Rate kResetRate{1, 2};
/// Likewise requests of its molecules' poses, of all users and of one.
inline constexpr net::Rate kPoseRate{16, 32}, kUserPoseRate{4, 8};

/// Likewise what they point at.
inline constexpr net::Rate kPointRate{4, 8};

/// Hands out the places of one room and tells the room's loop.
///
/// Thread  io; what is const, and on_update() of another seat, also who helps it meanwhile
class RoomSeats {
 public:
  explicit RoomSeats(Room& room);

  Room& room() const { return room_; }
  RoomStart& start() { return start_; }
  const RoomStart& start() const { return start_; }
  /// As the scene's file or the operator has set it.
  const physics::SceneCoupling& coupling() const { return coupling_; }
  /// What this is for the seat's tool and what it holds (common/physics/coupling_in_force.hpp).
  haptics::CouplingParameters coupling_in_force(const Seat& seat) const;

  /// The n-th manipulator takes the n-th free tool. Nothing when the scene's limits are reached.
  /// In      leaves_gaps  what does not come from this user is little enough to be extrapolated (a deadband)
  ///         device_bounds  of the coupling, that this user's device bears, in its newtons and metres
  ///         user_name  for recordings
  ///         tool  that the user would have, when it is free: the one he had before
  std::optional<Seat> take(UserRole role, bool leaves_gaps = false,
                           const haptics::CouplingParameters& device_bounds = haptics::kNoCouplingBounds,
                           std::string_view user_name = "", std::optional<std::uint8_t> tool = std::nullopt);
  /// Whether take() has a seat and a tool for that role now.
  bool has_place(UserRole role) const;
  /// With an operator goes what was set: the coupling is the scene's again.
  void leave(const Seat& seat);
  bool has_operator() const;
  void set_coupling(const Seat& seat, const haptics::CouplingParameters& parameters);
  /// In      law  that the scene can have (haptics::law_change_problem())
  void set_law(const Seat& seat, const haptics::CouplingLawInfo& law);
  /// All that moves back to its start (World::put_all_back()). False, and nothing is asked: the room does not keep up, or
  /// it was reset just now (kResetRate), for each reset tells everybody of every body that moves.
  bool reset(const Seat& seat, LocalTime now);
  bool may_ask_pose(LocalTime now) { return poses_.has_some(now) && poses_.take(1, now); }
  bool may_point(LocalTime now) { return points_.take(1, now); }
  /// In      placing  lacks the seat
  /// Out     false: the room does not keep up
  bool place(const Seat& seat, RoomCommand placing);
  /// False, and nothing is asked of the room, when it does not keep up or this seat's last request is not served yet
  /// (on_update()): one user cannot fill the queue that all share. The user is told.
  bool grab(const Seat& seat, BodyId body, std::uint32_t request);
  bool release(const Seat& seat, std::uint32_t request);
  /// What the room says of the seat's user: requests served, and what is held. Said anew after each step, so that a
  /// lost event leaves nothing wrong for long.
  void on_update(const Seat& seat, const RoomUpdate& told);
  /// Retries what the room's full queue refused.
  void flush();

 private:
  /// With or without a tool, as `role`.
  std::size_t count(UserRole role) const;
  std::optional<std::uint8_t> free_tool(std::optional<std::uint8_t> wanted) const;
  void post_coupling(const Seat& seat);
  void post_surely(const RoomCommand& command);
  bool post_request(const RoomCommand& command);

  Room& room_;
  RoomStart start_;
  physics::SceneCoupling coupling_;
  std::array<std::optional<Seat>, proto::kMaxUsers> seats_{};
  std::array<BodyId, proto::kMaxUsers> held_{};              ///< by the seat's tool
  std::array<std::uint64_t, proto::kMaxUsers> requested_{};  ///< grabs and releases since the seat's user joined
  std::array<std::uint64_t, proto::kMaxUsers> served_{};
  std::uint32_t last_user_ = 0;
  net::TokenBucket resets_{kResetRate};
  net::TokenBucket poses_{kPoseRate};
  net::TokenBucket points_{kPointRate};
  /// Joins and leaves must not be lost; bounded because a room that is behind takes nobody in.
  std::deque<RoomCommand> waiting_;
};

}  // namespace tandem::server

// Capabilities that the server offers to joined users, one class each. A SessionHub owns its services and calls them on
// the io thread; they reach users through ServiceHost only.
//
//   user ──message──▶ SessionHub ──handle()──▶ SessionService ──commands──▶ RoomSeats
//   room ──updates──▶     │ ──on_update()──▶      │      ◀──events, requests' results── on_poll()
//                         │ ◀── ServiceHost: answers, messages to a room, news, end of a user
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"
#include "server/room/room_seats.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline constexpr const char* kRoomBusy = "the room is busy; try again";

/// A user for services: valid, at the same address, from on_joined() until on_left() has returned.
struct SessionUser {
  std::string name;
  RoomSeats* seats = nullptr;
  Seat seat;

  const Room& room() const { return seats->room(); }
  bool is_operator() const { return seat.role == UserRole::kOperator; }
  /// For logs.
  std::string label() const;
};

/// Interface of the hub for its services. A message that is sent may end its user, if the user reads too slowly; users
/// who have left receive nothing.
class ServiceHost {
 public:
  /// Time of the hub's current call.
  virtual LocalTime now() const = 0;
  virtual const std::vector<std::unique_ptr<RoomSeats>>& rooms() const = 0;
  /// Users of a room, the oldest connection first.
  virtual std::vector<SessionUser*> users_of(const Room& room) const = 0;
  virtual void send(SessionUser& user, const wire::ServerControl& message) = 0;
  /// Control bytes that the user has not read yet.
  virtual std::size_t queued_bytes(const SessionUser& user) const = 0;
  /// Holds news for a user until send_news(), or until the user has read earlier bytes. They go out after joins and
  /// leaves, by ascending keys. Later news with the same key replace earlier ones; `make` runs when they are sent.
  virtual void announce(SessionUser& user, std::size_t key, std::function<wire::ServerControl()> make) = 0;
  /// Sends the held news, unless over kMaxQueuedBeforeNews bytes are queued. Each poll does this for all users.
  virtual void send_news(SessionUser& user) = 0;
  virtual void end(SessionUser& user, wire::DisconnectReason reason, const std::string& text) = 0;
  virtual void log(std::string_view kind, const std::string& line) const = 0;

  /// User of a room by id; null: there is none.
  SessionUser* find_user(const Room& room, UserId id) const;
  void refuse_request(SessionUser& user, std::uint32_t request, wire::ErrorCode code, const std::string& text);
  /// Sends a message to all users of a room; the number of the request goes only to the user who made it.
  void send_to_room(const Room& room, wire::ServerControl message, UserId requester = {}, std::uint32_t request = 0);

 protected:
  ~ServiceHost() = default;
};

/// A service keeps its own state of users, by the address of SessionUser, and erases it in on_left().
class SessionService {
 public:
  using Case = wire::ClientControl::MessageCase;

  virtual ~SessionService() = default;
  /// Messages that handle() serves, each served by one service.
  virtual std::vector<Case> cases() const { return {}; }
  virtual void handle(SessionUser& /*user*/, const wire::ClientControl& /*message*/) {}
  /// Called after Joined and the names of the others have been sent.
  virtual void on_joined(SessionUser& /*user*/, const wire::JoinRoom& /*granted*/) {}
  /// Called when the seat is free again and users_of() lacks the user, before the others receive UserLeft.
  virtual void on_left(SessionUser& /*user*/) {}
  /// Called when an update of a room has been sent to its users.
  virtual void on_update(const Room& /*room*/) {}
  /// Called in each SessionHub::poll() after all updates: delivers results of rooms and threads.
  virtual void on_poll() {}
  /// Refuses the requests that are not started, and all later ones; on_poll() delivers the answers.
  virtual void begin_stop() {}
  virtual bool owes_answers() const { return false; }
  /// Answers all requests now; no on_poll() follows.
  virtual void refuse_unanswered() {}
};

}  // namespace tandem::server

// Services for joined users, one class per capability. A SessionHub owns its services and calls them on the io thread.
// Services send to users through ServiceHost only.
//
//   user ──message──▶ SessionHub ──handle()──▶ SessionService ──commands──▶ RoomSeats
//   room ──updates──▶     │ ──on_update()──▶      │      ◀──events, results of requests── on_poll()
//                         │ ◀── ServiceHost: answers, messages to a room, notifications, end of a connection
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

/// A joined user, as far as services need the data. The object stays at the same address from on_joined() until
/// on_left() returns, so services can use its address as a key.
struct SessionUser {
  std::string name;
  RoomSeats* seats = nullptr;
  Seat seat;

  const Room& room() const { return seats->room(); }
  bool is_operator() const { return seat.role == UserRole::kOperator; }
  bool is_source() const { return seat.role == UserRole::kSignal; }
  /// Returns text that identifies the user in logs.
  std::string label() const;
};

/// Interface through which services use the hub. If a user reads too slowly, sending a message may end that user's
/// connection. Messages to a user who has left are ignored.
class ServiceHost {
 public:
  /// Time of the current call of the hub.
  virtual LocalTime now() const = 0;
  virtual const std::vector<std::unique_ptr<RoomSeats>>& rooms() const = 0;
  /// Users of a room, in the order in which they connected.
  virtual std::vector<SessionUser*> users_of(const Room& room) const = 0;
  virtual void send(SessionUser& user, const wire::ServerControl& message) = 0;
  /// Number of control bytes that the user has not read yet.
  virtual std::size_t queued_bytes(const SessionUser& user) const = 0;
  /// Queues a notification for send_news(). Notifications are sent after joins and leaves, in ascending order of keys.
  /// A notification replaces an unsent one with the same key. `make` creates the message at the time of sending.
  virtual void announce(SessionUser& user, std::size_t key, std::function<wire::ServerControl()> make) = 0;
  /// Sends the queued notifications, unless more than kMaxQueuedBeforeNews bytes are queued for the user. Each poll()
  /// of the hub calls this function for all users.
  virtual void send_news(SessionUser& user) = 0;
  virtual void end(SessionUser& user, wire::DisconnectReason reason, const std::string& text) = 0;
  virtual void log(std::string_view kind, const std::string& line) const = 0;

  /// Finds a user of a room by id; null if there is no such user.
  SessionUser* find_user(const Room& room, UserId id) const;
  void refuse_request(SessionUser& user, std::uint32_t request, wire::ErrorCode code, const std::string& text);
  /// Sends a message to all users of a room. Only the copy for `requester` contains the request number.
  void send_to_room(const Room& room, wire::ServerControl message, UserId requester = {}, std::uint32_t request = 0);

 protected:
  ~ServiceHost() = default;
};

/// Base class of services. A service may store data per user, with the address of the SessionUser as key. It must erase
/// them in on_left().
class SessionService {
 public:
  using Case = wire::ClientControl::MessageCase;

  virtual ~SessionService() = default;
  /// Returns the kinds of messages that handle() accepts. Only one service handles each kind.
  virtual std::vector<Case> cases() const { return {}; }
  virtual void handle(SessionUser& /*user*/, const wire::ClientControl& /*message*/) {}
  /// Called after a user has joined and has received Joined and the names of the other users. Not called for a source
  /// of signals.
  virtual void on_joined(SessionUser& /*user*/, const wire::JoinRoom& /*granted*/) {}
  /// Called after a user has left: the seat is free, and users_of() does not include the user. UserLeft has not been
  /// sent to the other users yet.
  virtual void on_left(SessionUser& /*user*/) {}
  /// Called after an update of a room has been sent to its users.
  virtual void on_update(const Room& /*room*/) {}
  /// Called in each SessionHub::poll() after all updates have been sent. Delivers results from rooms and other threads.
  virtual void on_poll() {}
  /// Refuses the requests that have not been started, and all later requests. on_poll() sends the refusals.
  virtual void begin_stop() {}
  /// Returns whether a request has not been answered yet.
  virtual bool owes_answers() const { return false; }
  /// Refuses all unanswered requests immediately. After this call, on_poll() is not called.
  virtual void refuse_unanswered() {}
};

}  // namespace tandem::server

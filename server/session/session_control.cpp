#include <algorithm>
#include <utility>

#include "server/session/session_hub_impl.hpp"

namespace tandem::server {
namespace {

std::string whole(double number) {
  return std::to_string(static_cast<int>(number));
}

constexpr std::size_t kMaxProgramBytes = 200;
constexpr int kMaxCapabilities = 32;

}  // namespace

void SessionHub::Impl::receive_control(Connection& connection, std::span<const std::byte> bytes) {
  if (!connection.reader.feed(bytes)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message was too long");
    return;
  }
  serve(connection);
}

/// Handles received messages of a connection, as far as the budgets allow. The remaining messages stay in the reader.
void SessionHub::Impl::serve(Connection& connection) {
  wire::ClientControl message;
  while (connection.state != ConnectionState::kClosed && !connection.held_join && connection.reader.has_next() &&
         has_turn(connection)) {
    if (!proto::parse_control(*connection.reader.next(), message)) {
      end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "a control message could not be read");
      return;
    }
    connection.last_received = called_at;
    if (!can_afford(connection, message)) {
      end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
          "too many control messages: at most " + whole(kControlRate.per_second) + " a second, and " +
              whole(kControlRate.at_once) + " at once");
      return;
    }
    handle(connection, message);
  }
}

/// Handles received messages of all connections, in cyclic order that begins after the connection handled last.
void SessionHub::Impl::serve_waiting() {
  const auto serve_range = [this](auto from, auto to) {
    for (; from != to && turn.has_some(called_at); ++from) {
      if (!from->second->reader.has_next()) continue;
      served_last = from->first;
      serve(*from->second);
    }
  };
  const auto next = connections.upper_bound(served_last);
  serve_range(next, connections.end());
  serve_range(connections.begin(), next);
}

/// Returns whether the budgets of the io thread's cycle, of the connection and of its address permit another message.
/// The budget of the address applies only before the user has joined. Other connections from the same address thus
/// cannot delay a joined user.
bool SessionHub::Impl::has_turn(const Connection& connection) const {
  if (!turn.has_some(called_at) || !connection.turn.has_some(called_at)) return false;
  return !connection.is_half_open() || connection.address->control.has_some(called_at);
}

/// Consumes the tokens for a message. Returns false if the connection exceeds its rate. The caller must then close the
/// connection, because its messages would delay the states of all users.
bool SessionHub::Impl::can_afford(Connection& connection, const wire::ClientControl& message) {
  const bool has_own_pace = message.has_state_datagram() || message.has_get_asset();
  const double price = has_own_pace ? kOwnPace : 1.0;
  const double work = message.has_get_asset() || message.has_join() ? kBigAnswer : 1.0;
  turn.consume(work, called_at);
  connection.turn.consume(work, called_at);
  // Messages that a joined user's client sends automatically consume no tokens of the address. Otherwise they would
  // delay new users from the same address.
  if (connection.is_half_open() || !has_own_pace) {
    connection.address->control.consume(message.has_join() ? kJoinPrice : price, called_at);
  }
  return connection.control.consume(price, called_at);
}

void SessionHub::Impl::handle(Connection& connection, const wire::ClientControl& message) {
  if (message.has_hello() && connection.state == ConnectionState::kGreeting) {
    greet(connection, message);
  } else if (message.has_join() && connection.state == ConnectionState::kJoining) {
    join(connection, message);
  } else if (!handle_in_any_state(connection, message) && !handle_active(connection, message)) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR,
        "that control message is not allowed in state " + std::string(name_of(connection.state)));
  }
}

bool SessionHub::Impl::handle_in_any_state(Connection& connection, const wire::ClientControl& message) {
  if (message.has_leave()) {
    if (message.leave().to_return() && connection.credential) {
      admission->note_lost(*std::exchange(connection.credential, std::nullopt), called_at);
    }
    close(connection, wire::DISCONNECT_LEFT, "left on request", message.request());
    return true;
  }
  if (message.has_ping() && connection.state != ConnectionState::kGreeting) {
    wire::ServerControl answer;
    answer.set_request(message.request());
    answer.mutable_pong()->set_token(message.ping().token());
    send(connection, answer);
    return true;
  }
  return false;
}

bool SessionHub::Impl::handle_active(Connection& connection, const wire::ClientControl& message) {
  if (connection.state != ConnectionState::kActive) return false;
  if (connection.is_source() && !message.has_signal()) {
    refuse_request(connection, message.request(), wire::ERROR_NOT_ALLOWED,
                   "a source of signals may only send signals; join in another role");
    return true;
  }
  if (message.has_state_datagram()) {
    owner.on_datagram(std::as_bytes(std::span(message.state_datagram())), called_at,
                      [&connection](ConnectionHandle handle) { return handle == connection.handle; });
    return true;
  }
  const auto handler = handlers.find(message.message_case());
  if (handler == handlers.end()) return false;
  handler->second->handle(connection, message);
  return true;
}

void SessionHub::Impl::greet(Connection& connection, const wire::ClientControl& message) {
  const wire::Hello& hello = message.hello();
  if (hello.protocol_version() != proto::kProtocolVersion) {
    const std::string text = "this server speaks protocol version " + std::to_string(proto::kProtocolVersion) +
                             ", the client " + std::to_string(hello.protocol_version()) +
                             "; use programs of the same version";
    ++counters.refusals[wire::ERROR_WRONG_VERSION];
    send(connection, error_answer(message.request(), wire::ERROR_WRONG_VERSION, text));
    end(connection, wire::DISCONNECT_WRONG_VERSION, text);
    return;
  }
  if (hello.program().size() > kMaxProgramBytes || hello.capabilities_size() > kMaxCapabilities) {
    end(connection, wire::DISCONNECT_PROTOCOL_ERROR, "hello is over its limits");
    return;
  }
  const auto can = [&hello](const char* capability) {
    return std::find(hello.capabilities().begin(), hello.capabilities().end(), capability) !=
           hello.capabilities().end();
  };
  connection.state_over_tcp = can(proto::kCapabilityStateTcp) && !can(proto::kCapabilityStateUdp);
  do {
    connection.id = ConnectionId{settings.connection_ids()};
  } while (!connection.id.is_valid() || active.contains(connection.id));
  active[connection.id] = &connection;
  connection.state = ConnectionState::kJoining;
  wire::ServerControl answer = welcome_answer(message.request(), settings);
  answer.mutable_welcome()->set_connection_id(connection.id.value);
  answer.mutable_welcome()->set_epoch(connection.epoch);
  for (const auto& seats : room_seats) answer.mutable_welcome()->add_rooms(seats->room().name());
  send(connection, answer);
}

}  // namespace tandem::server

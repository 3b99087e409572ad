#include "client/signals/signal_session.hpp"

#include <algorithm>
#include <utility>

#include "proto/signals.hpp"
#include "proto/state.hpp"

namespace tandem::client {
namespace {

std::string milliseconds(Duration duration) {
  return std::to_string(duration / std::chrono::milliseconds(1)) + " ms";
}

}  // namespace

std::string problem_of(const Signal& signal) {
  if (!proto::is_signal_name(signal.name)) {
    return "the name '" + printable(signal.name) + "' " + std::string(proto::kSignalNameRule);
  }
  if (!proto::is_signal_value(signal.value)) {
    return "the value of " + signal.name + " is " + std::to_string(signal.value) + "; it must be -1e6 to 1e6";
  }
  if (!proto::is_confidence(signal.confidence)) {
    return "the confidence of " + signal.name + " is " + std::to_string(signal.confidence) + "; it must be 0 to 1";
  }
  return {};
}

SignalSession::SignalSession(SignalSessionSettings settings, ClientTransport& transport)
    : settings_(std::move(settings)),
      transport_(transport),
      credentials_(std::exchange(settings_.token, {})),
      retry_delay_(settings_.reconnect_delay) {}

void SignalSession::start(LocalTime now) {
  connect(now);
}

void SignalSession::connect(LocalTime now) {
  enter(SessionState::kConnecting, now);
  reader_ = proto::FrameReader();
  transport_.connect(now);
}

void SignalSession::enter(SessionState state, LocalTime now) {
  status_.state = state;
  entered_ = received_ = now;
}

void SignalSession::on_connected(LocalTime now) {
  if (status_.state != SessionState::kConnecting) return;
  enter(SessionState::kGreeting, now);
  wire::ClientControl message;
  message.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
  message.mutable_hello()->set_program("tandem-signal");
  send(message);
}

void SignalSession::on_disconnected(LocalTime now, const std::string& why) {
  lose(now, why);
}

void SignalSession::on_control_bytes(std::span<const std::byte> bytes, LocalTime now) {
  const auto is_open = [this] {
    return status_.state != SessionState::kEnded && status_.state != SessionState::kWaiting;
  };
  if (!is_open()) return;
  if (!reader_.feed(bytes)) return lose(now, "protocol error: the server announced a control message that is too long");
  wire::ServerControl message;
  while (is_open()) {
    const auto payload = reader_.next();
    if (!payload) return;
    if (!proto::parse_control(*payload, message)) {
      return lose(now, "protocol error: a control message of the server could not be read");
    }
    received_ = now;
    handle(message, now);
  }
}

void SignalSession::handle(const wire::ServerControl& message, LocalTime now) {
  if (message.has_welcome() && status_.state == SessionState::kGreeting) {
    join(message.welcome(), now);
  } else if (message.has_joined() && status_.state == SessionState::kJoining) {
    begin(message.joined(), now);
  } else if (message.has_goodbye()) {
    const wire::DisconnectReason reason = message.goodbye().reason();
    lose(now, "the server ended the connection: " + message.goodbye().text(),
         reason == wire::DISCONNECT_WRONG_VERSION || reason == wire::DISCONNECT_RESUMED);
  } else if (message.has_error() && status_.state != SessionState::kActive) {
    const bool may_pass =
        message.error().code() == wire::ERROR_ROOM_FULL || message.error().code() == wire::ERROR_SERVER_FULL;
    lose(now, "the server refused: " + message.error().text(), !(has_joined_ && may_pass));
  } else if (message.has_error()) {
    ++refused_;
    log("refused: " + message.error().text());
  } else if (message.has_pong()) {
    confirm(message.pong().token());
  }
}

void SignalSession::join(const wire::Welcome& welcome, LocalTime now) {
  if (welcome.protocol_version() != proto::kProtocolVersion) {
    return lose(now,
                "the server speaks protocol version " + std::to_string(welcome.protocol_version()) + ", this program " +
                    std::to_string(proto::kProtocolVersion) + "; use programs of the same version",
                true);
  }
  if (welcome.connection_id() == 0) return lose(now, "protocol error: the server's welcome has no connection id");
  enter(SessionState::kJoining, now);
  wire::ClientControl message;
  wire::JoinRoom& join = *message.mutable_join();
  join.set_room(settings_.room);
  join.set_user_name(settings_.name);
  join.set_role(wire::ROLE_SIGNAL);
  credentials_.fill(join, transport_, ConnectionId{welcome.connection_id()});
  send(message);
}

void SignalSession::begin(const wire::Joined& joined, LocalTime now) {
  credentials_.accept(joined);
  names_.clear();
  for (const std::string& name : joined.signals()) {
    if (names_.size() < kMaxNames) names_.push_back(printable(name));
  }
  has_joined_ = true;
  retry_delay_ = settings_.reconnect_delay;
  status_.why.clear();
  enter(SessionState::kActive, now);
  pinged_ = now;
}

void SignalSession::lose(LocalTime now, const std::string& why, bool is_final) {
  if (status_.state == SessionState::kEnded || status_.state == SessionState::kWaiting) return;
  transport_.close();
  status_.why = printable(why);
  for (const auto& [name, sent] : unconfirmed_) {
    if (waiting_.size() < kMaxNames) waiting_.try_emplace(name, sent.first);
  }
  unconfirmed_.clear();
  if (is_final || !has_joined_) {
    if (has_joined_) log(why + "; no more values are sent");
    status_.state = SessionState::kEnded;
    status_.is_setup_error = true;
    return;
  }
  enter(SessionState::kWaiting, now);
  log(why + "; trying again in " + milliseconds(retry_delay_));
}

void SignalSession::check_time_outs(LocalTime now) {
  switch (status_.state) {
    case SessionState::kConnecting:
    case SessionState::kGreeting:
    case SessionState::kJoining:
      if (now - entered_ < settings_.setup_timeout) return;
      return lose(now, "the server did not answer within " + milliseconds(settings_.setup_timeout) + " (" +
                           std::string(name_of(status_.state)) + ")");
    case SessionState::kActive:
      if (now - received_ < settings_.silence_timeout) return;
      return lose(now, "nothing was received from the server for " + milliseconds(settings_.silence_timeout));
    case SessionState::kWaiting:
      if (now - entered_ < retry_delay_) return;
      retry_delay_ = std::min(2 * retry_delay_, settings_.reconnect_delay_max);
      return connect(now);
    case SessionState::kEnded:
      return;
  }
}

bool SignalSession::set(const Signal& signal) {
  if (!problem_of(signal).empty()) return false;
  if (waiting_.size() >= kMaxNames && !waiting_.contains(signal.name)) return false;
  waiting_[signal.name] = signal;
  return true;
}

void SignalSession::poll(LocalTime now) {
  if (status_.state == SessionState::kActive) {
    send_waiting(now);
    const auto needs_ping = [this](const auto& sent) { return sent.second.second > pings_; };
    const bool is_urgent = hastens_ && waiting_.empty() && std::ranges::any_of(unconfirmed_, needs_ping);
    if (is_urgent || now - pinged_ >= settings_.ping_every) ping(now);
  }
  check_time_outs(now);
}

void SignalSession::ping(LocalTime now) {
  pinged_ = now;
  wire::ClientControl message;
  message.mutable_ping()->set_token(++pings_);
  send(message);
}

/// Removes the values whose arrival the answer to `ping` confirms: those that were sent before this ping.
void SignalSession::confirm(std::uint64_t ping) {
  if (ping > pings_) return;
  std::erase_if(unconfirmed_, [ping](const auto& sent) { return sent.second.second <= ping; });
}

/// Sends waiting values, as long as the rate limit permits it and the connection accepts bytes at once. Values that
/// must wait stay here, where newer values can replace them.
void SignalSession::send_waiting(LocalTime now) {
  while (!waiting_.empty() && transport_.queued_control_bytes() == 0 && budget_.try_consume(1, now)) {
    const auto next = waiting_.begin();
    if (unconfirmed_.size() >= kMaxNames && !unconfirmed_.contains(next->first)) return;
    const Signal& signal = next->second;
    wire::ClientControl message;
    wire::Signal& out = *message.mutable_signal();
    out.set_name(signal.name);
    out.set_value(signal.value);
    out.set_confidence(signal.confidence);
    out.set_age_s(std::clamp(to_seconds(now - signal.measured), 0.0, proto::kMaxSignalAge_s));
    send(message);
    ++sent_;
    unconfirmed_.insert_or_assign(next->first, std::pair(signal, pings_ + 1));
    waiting_.erase(next);
  }
}

void SignalSession::send(wire::ClientControl& message) {
  frame_.clear();
  proto::append_frame(message, frame_);
  transport_.send_control(frame_);
}

void SignalSession::leave() {
  if (status_.state == SessionState::kEnded) return;
  if (status_.state == SessionState::kActive) {
    wire::ClientControl message;
    message.mutable_leave();
    send(message);
  }
  status_.state = SessionState::kEnded;
  transport_.close();
}

}  // namespace tandem::client

// Connection of a source of signals to a room, without sockets, threads and clock. proto/WIRE.md ("Signals") defines
// the messages. A live source uses SignalConnection, which adds sockets, a thread and a clock.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/session/credentials.hpp"
#include "client/session/session.hpp"
#include "common/net/token_bucket.hpp"
#include "proto/control_framing.hpp"

namespace tandem::client {

/// A named number that a program measures, such as a heart rate or the valence of an electroencephalogram.
struct Signal {
  std::string name;
  double value = 0;       ///< value in the unit of the signal, -1e6 … 1e6
  double confidence = 1;  ///< confidence in the value, 0 … 1
  LocalTime measured{};   ///< time of the measurement, by the clock of the caller
};

/// Reason why a signal cannot be sent, with the remedy; empty if it can.
std::string problem_of(const Signal& signal);

struct SignalSessionSettings {
  std::string room;             ///< name of the room; "": the server's only room
  std::string name = "signal";  ///< name of the source, for the server's log
  proto::Bytes token{};         ///< one-time token for the role of a source; sent only over an encrypted connection
  Duration setup_timeout{std::chrono::seconds(5)};  ///< limit of each step: connecting, greeting, joining
  Duration silence_timeout{std::chrono::milliseconds(1500)};
  Duration ping_every{std::chrono::milliseconds(400)};
  Duration reconnect_delay{std::chrono::milliseconds(250)};  ///< first delay; doubled up to reconnect_delay_max
  Duration reconnect_delay_max{std::chrono::seconds(2)};
};

/// Sends the newest value of each signal:
/// * A value that cannot be sent at once waits. A newer value of the same signal replaces it. The waiting time is added
///   to the age of the value.
/// * A lost connection is restored automatically. Values whose arrival is not confirmed are then sent again.
/// * The answer to a ping confirms all values that were sent before the ping.
///
/// Limits  kMaxNames names; at most kRate values are sent, below the limit of the server
/// Thread  any, one at a time
class SignalSession final : public TransportListener {
 public:
  static constexpr std::size_t kMaxNames = 64;
  static constexpr net::Rate kRate{40, 40};

  SignalSession(SignalSessionSettings settings, ClientTransport& transport);

  void start(LocalTime now);
  void on_connected(LocalTime now) override;
  void on_disconnected(LocalTime now, const std::string& why) override;
  void on_control_bytes(std::span<const std::byte> bytes, LocalTime now) override;
  void on_datagram(std::span<const std::byte> /*datagram*/, LocalTime /*now*/) override {}
  /// Stores a value for sending. Returns false if problem_of() names a problem, or if kMaxNames names wait already.
  bool set(const Signal& signal);
  /// Sends waiting values, keeps the connection alive, and checks time-outs. Call it every few milliseconds.
  void poll(LocalTime now);
  /// Sends a ping as soon as all values are sent. So their arrival is confirmed earlier than by the next regular ping.
  void hasten_confirmation() { hastens_ = true; }
  void leave();

  const SessionStatus& status() const { return status_; }
  bool has_joined() const { return has_joined_; }
  /// Signals of the room's game, as received when the session joined.
  const std::vector<std::string>& names() const { return names_; }
  std::size_t waiting() const { return waiting_.size(); }
  /// Number of names whose last sent value is not confirmed.
  std::size_t unconfirmed() const { return unconfirmed_.size(); }
  std::uint64_t sent() const { return sent_; }
  std::uint64_t refused() const { return refused_; }
  /// Called with each line for the user: losses, and refusals of the server.
  std::function<void(const std::string& line)> on_log;

 private:
  void connect(LocalTime now);
  void enter(SessionState state, LocalTime now);
  void handle(const wire::ServerControl& message, LocalTime now);
  void join(const wire::Welcome& welcome, LocalTime now);
  void begin(const wire::Joined& joined, LocalTime now);
  void lose(LocalTime now, const std::string& why, bool is_final = false);
  void check_time_outs(LocalTime now);
  void send_waiting(LocalTime now);
  void ping(LocalTime now);
  void confirm(std::uint64_t ping);
  void send(wire::ClientControl& message);
  void log(const std::string& line) const {
    if (on_log) on_log(printable(line));
  }

  SignalSessionSettings settings_;
  ClientTransport& transport_;
  Credentials credentials_;
  SessionStatus status_;
  proto::FrameReader reader_;
  proto::Bytes frame_;
  LocalTime entered_{};  ///< time of the last change of state
  LocalTime received_{};
  LocalTime pinged_{};
  Duration retry_delay_;
  net::TokenBucket budget_{kRate};
  bool has_joined_ = false;
  std::vector<std::string> names_;
  std::map<std::string, Signal> waiting_;
  /// Last sent value of each name, with the number of the ping whose answer confirms its arrival.
  std::map<std::string, std::pair<Signal, std::uint64_t>> unconfirmed_;
  std::uint64_t pings_ = 0;
  bool hastens_ = false;
  std::uint64_t sent_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace tandem::client

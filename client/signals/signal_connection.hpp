// A live source of signals: the sockets, and the thread that drives a SignalSession.
//
//   any thread ── send() ──post──▶ io thread: SignalSession ◀──TLS──▶ server
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/net/asio_client_transport.hpp"
#include "client/signals/signal_session.hpp"

namespace tandem::client {

struct SignalConnectionSettings {
  std::string host = "127.0.0.1";  ///< address of the server: a loopback address; with `trust` any address or name
  std::uint16_t port = 47800;
  std::optional<secure::Trust> trust{};  ///< key or authorities to verify the server; none: no TLS (--insecure)
  SignalSessionSettings session{};
  /// Called on the io thread with each line for the user. It must neither block nor throw.
  std::function<void(const std::string& line)> on_log{};
};

/// Copy of the session's state for other threads.
struct SignalConnectionStatus {
  SessionStatus session;
  bool has_joined = false;
  std::vector<std::string> names;  ///< names of the signals that the room's game uses
  std::size_t waiting = 0;         ///< number of values that are not sent yet
  std::size_t unconfirmed = 0;     ///< number of names whose last sent value the server has not confirmed
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;  ///< number of refusals by the server
};

/// Thread  any; a call takes a lock for a moment
class SignalConnection {
 public:
  /// Starts the io thread, which connects.
  /// Fails   std::invalid_argument: see AsioClientTransport
  explicit SignalConnection(SignalConnectionSettings settings);
  /// Calls stop().
  ~SignalConnection();
  SignalConnection(const SignalConnection&) = delete;
  SignalConnection& operator=(const SignalConnection&) = delete;

  /// Waits until the source has joined the room.
  /// Fails   std::runtime_error if the session ends before; the message is for the user
  void wait_until_joined();
  /// Queues a value, which is sent within milliseconds. If the connection is lost, it is sent once the connection is
  /// restored.
  /// In      age  time since the measurement
  /// Fails   std::invalid_argument if problem_of(signal) names a problem; this is the message
  void send(Signal signal, Duration age = {});
  /// Waits until the server has confirmed the arrival of all values. All refusals of these values have then arrived as
  /// well. Returns false if the confirmation takes longer than `patience`, or if the session has ended.
  bool flush(Duration patience);
  SignalConnectionStatus status() const;
  /// Leaves the room and joins the thread. Repeated calls have no effect.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client

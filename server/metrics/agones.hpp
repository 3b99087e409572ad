// Reports the server's state to Agones, which starts and ends game servers in a Kubernetes cluster. A report is a call
// to the sidecar that Agones runs beside each server (REST interface of Agones' SDK).
//
//   event                        call
//   all rooms are loaded         POST /ready
//   every 2 s while healthy      POST /health
//   the first user joins         GET /gameserver, and POST /allocate unless the server is Allocated already
//   no user for a minute         POST /ready
//   the server ends              POST /shutdown
//
// Source   Agones documentation, "Client SDKs", REST (agones.dev/site/docs/guides/client-sdks/rest)
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/time.hpp"
#include "common/recording/recorder_thread.hpp"

namespace tandem::server {

/// Parses the port of the sidecar. "auto" means AGONES_SDK_HTTP_PORT if it is set, otherwise Agones' default port.
/// Fails   std::invalid_argument: not a port
std::uint16_t agones_port(const std::string& text);

/// Decides which call to the sidecar is due. It uses neither socket nor clock, so that tests can control both.
class AgonesPlan {
 public:
  enum class Call : std::uint8_t { kNone, kReady, kHealth, kGameServer, kAllocate, kShutdown };
  /// State of the server, the input of the decision.
  struct Seen {
    bool is_ready = false;
    bool is_healthy = false;
    bool has_ended = false;
    std::size_t users = 0;
  };
  /// Period of health reports. With its default settings, Agones declares a server unhealthy after three missed periods
  /// of 5 s.
  static constexpr Duration kHealthEvery{std::chrono::seconds(2)};
  static constexpr Duration kMinAgain{std::chrono::milliseconds(500)};
  static constexpr Duration kMaxAgain{std::chrono::seconds(4)};
  /// Time without users after which the server is offered to other users. A user who has lost the connection has
  /// rejoined by then, or would find the scene reset anyway.
  static constexpr Duration kReturnAfter{std::chrono::minutes(1)};

  Call due(const Seen& seen, LocalTime now);
  /// Records whether a call has succeeded. A failed call is repeated after a pause.
  /// In      is_allocated  for kGameServer: true if the answer gives the state Allocated
  void note_answer(Call call, bool is_good, LocalTime now, bool is_allocated = false);

 private:
  bool has_sent_ready_ = false, has_sent_shutdown_ = false;
  bool has_game_server_ = false, is_allocated_ = false;
  LocalTime next_health_{};
  LocalTime not_before_{};
  Duration again_{0};  ///< pause after the last failed call, doubled by the next failed call
  std::optional<LocalTime> left_;
};

/// Reports the server's state by calls to the sidecar. The server also works if there is no sidecar.
///
/// Thread  a separate thread of normal priority, which may wait for the sidecar
class Agones {
 public:
  /// In      port  the sidecar's port on this machine
  ///         read_status  called on the separate thread
  ///         on_news  receives messages for the operator when the sidecar starts or stops answering; called on the
  ///                  separate thread
  Agones(std::uint16_t port, std::function<AgonesPlan::Seen()> read_status,
         std::function<void(const std::string&)> on_news);
  ~Agones();
  /// Sends a last report, from the status that `read_status` then returns. Takes at most about a second. Repeated calls
  /// have no effect.
  void finish();

 private:
  struct Reply;
  void work();
  Reply call(const std::string& path, bool is_post) const;
  void report(const Reply& reply);

  std::uint16_t port_;
  std::function<AgonesPlan::Seen()> read_status_;
  std::function<void(const std::string&)> on_news_;
  AgonesPlan plan_;
  std::optional<bool> is_reachable_;
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server

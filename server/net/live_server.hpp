// A whole server in one object: sockets, session hub, rooms and their threads, for the program and for tests.
//
//   threads that step rooms                 io thread (run())
//   Room::answer() ──mailboxes, rings──▶     SessionHub::poll(): updates and answers go out
//        └──────── eventfd ─────────▶       wakes, if it sleeps, after an answer or the few that follow each other at once
//   ◀──mailboxes, rings──                   SessionHub::on_…: what the sockets bring
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"
#include "server/net/room_scheduler.hpp"
#include "server/room/server_rooms.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

struct LiveServerSettings {
  std::string bind_address = "127.0.0.1";  ///< without `tls` loopback only
  std::uint16_t port = 47800;              ///< TCP and UDP; 0: any
  int realtime_priority = 0;               ///< SCHED_FIFO of the room threads; 0: normal scheduler
  std::optional<Duration> duration{};      ///< stop by itself after this long
  bool stops_on_signals = false;  ///< SIGINT, SIGTERM and SIGHUP call stop(), the last unless it was ignored before
  std::shared_ptr<const secure::TlsContext> tls{};  ///< null: nothing is encrypted
  HubSettings hub{};                                ///< connection_ids, where empty, is filled in
};

/// What a server has counted so far.
struct ServerFigures {
  HubCounters hub{};
  std::uint64_t failed_handshakes = 0;
  std::size_t connections = 0;                      ///< joined or not
  std::vector<std::array<std::size_t, 3>> users{};  ///< of each room, by UserRole
};

/// Whether a server goes on.
struct ServerPulse {
  bool is_serving = false;  ///< run() has begun
  bool is_stopping = false;
  std::size_t users = 0;
  LocalTime io{};                  ///< when its io thread last went round
  std::vector<LocalTime> rooms{};  ///< likewise each room: it has stepped, or found that nobody is there
};

class LiveServer {
 public:
  /// Opens the port.
  /// Fails   std::invalid_argument, std::runtime_error: as AsioServerTransport; std::system_error: no descriptor
  LiveServer(LiveServerSettings settings, ServerRooms rooms);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  std::uint16_t port() const;
  const std::vector<std::unique_ptr<Room>>& rooms() const;
  /// A service of the rooms that is made after the server. Before run(). Null in, null out.
  template <class Service>
  Service* add(std::unique_ptr<Service> service) {
    return served().add(std::move(service));
  }

  /// Serves until stopped; the calling thread is the io thread. Once only. When it returns or throws, no room steps any more,
  /// and each service has finished.
  /// Fails   what was thrown on the io thread, or else by a service that finished
  void run();
  /// Refuses requests that wait, says goodbye to everybody and lets run() return, within about a second and a half.
  /// Thread  any
  void stop();
  /// Lets run() return at once, without a goodbye, as a crash would.
  /// Thread  any
  void abandon();

  // What it does, while it runs: a tenth of a second old, and neither io nor rooms wait for who asks.
  /// Thread  any, always the same for these two
  const ServerFigures& newest_figures();
  std::vector<RoomTiming> newest_timings();
  /// Thread  any
  ServerPulse pulse() const;

  // What the server did; after run().
  Duration up() const;
  const HubCounters& counters() const;
  std::uint64_t failed_handshakes() const;
  /// In the order of the rooms.
  std::vector<RoomTiming> room_timings() const;

  /// Set before run(); called on the io thread: no wait. A line, and its kind, of which there are few.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// Set before run(); called on the io thread: no wait. Who may come back, and which tokens were used: it has changed.
  std::function<void(const wire::AdmissionState&)> on_admission;
  /// Set before run(); called on the thread of each room after the answer of its step and before that is sent, while nobody
  /// else changes that room's world: no lock, no wait. `deadline`: when the step was due.
  std::function<void(const Room&, LocalTime deadline)> on_step;

 private:
  ServerRooms& served();

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server

// A whole server in one object: sockets, session hub, and rooms with their threads. Used by the program and by tests.
//
//   threads that step rooms                 io thread (run())
//   Room::answer() ──mailboxes, rings──▶     SessionHub::poll(): sends updates and answers
//        └──────── eventfd ─────────▶       wakes if it sleeps and new states are ready or expected soon
//   ◀──mailboxes, rings──                   SessionHub::on_…: receives bytes and datagrams from the sockets
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
  std::string bind_address = "127.0.0.1";  ///< address to listen at; without `tls` it must be a loopback address
  std::uint16_t port = 47800;              ///< port for TCP and UDP; 0: any free one
  int realtime_priority = 0;               ///< SCHED_FIFO priority of the room threads; 0: normal scheduler
  std::optional<Duration> duration{};      ///< time after which the server stops without a request
  /// true: SIGINT, SIGTERM and SIGHUP call stop(). SIGHUP is ignored if the process ignored it at the start.
  bool stops_on_signals = false;
  std::shared_ptr<const secure::TlsContext> tls{};  ///< null: no encryption
  HubSettings hub{};                                ///< if its connection_ids is empty, LiveServer sets it
};

/// Counters of a server.
struct ServerFigures {
  HubCounters hub{};
  std::uint64_t failed_handshakes = 0;
  std::size_t connections = 0;                      ///< number of open connections, with and without a joined user
  std::vector<std::array<std::size_t, 3>> users{};  ///< number of users of each room, by UserRole
};

/// Liveness of a server.
struct ServerPulse {
  bool is_serving = false;  ///< whether run() has begun
  bool is_stopping = false;
  std::size_t users = 0;
  LocalTime io{};                  ///< time of the io thread's last iteration
  std::vector<LocalTime> rooms{};  ///< time at which each room's loop last made a step or found no users
};

class LiveServer {
 public:
  /// Opens the port.
  /// Fails   std::invalid_argument, std::runtime_error: see AsioServerTransport; std::system_error: no free descriptor
  LiveServer(LiveServerSettings settings, ServerRooms rooms);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  std::uint16_t port() const;
  const std::vector<std::unique_ptr<Room>>& rooms() const;
  /// Adds a service that needs the server to exist, and returns it; null is returned unchanged. Call before run().
  template <class Service>
  Service* add(std::unique_ptr<Service> service) {
    return served().add(std::move(service));
  }

  /// Serves until stopped. The calling thread becomes the io thread. Call only once. When run() returns or throws, all
  /// rooms have stopped and all services have finished.
  /// Fails   rethrows the exception of the io thread; without one, the first exception from a service's finish()
  void run();
  /// Refuses waiting requests and ends all connections. run() then returns within about 1.5 s.
  /// Thread  any
  void stop();
  /// Makes run() return at once without goodbye messages, as in a crash.
  /// Thread  any
  void abandon();

  // State of the running server, up to 0.1 s old. Reading it blocks neither io nor rooms.
  /// Thread  any, but always the same one for both functions
  const ServerFigures& newest_figures();
  std::vector<RoomTiming> newest_timings();
  /// Returns the liveness of the server.
  /// Thread  any
  ServerPulse pulse() const;

  // Results, available after run().
  Duration up() const;
  const HubCounters& counters() const;
  std::uint64_t failed_handshakes() const;
  /// Timings of the rooms, in their order.
  std::vector<RoomTiming> room_timings() const;

  /// Log sink: receives the kind of a line and the line. The kinds are a small fixed set. Set it before run(). It is
  /// called on the io thread and must not block.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// Called when the admission state (credentials, used tokens) changes. Set before run(). It is called on the io
  /// thread and must not block.
  std::function<void(const wire::AdmissionState&)> on_admission;
  /// Called for each step of a room after its answer and before its updates are sent. Nothing else changes the room's
  /// world during the call. `deadline` is the time at which the step was due. Set it before run(). It is called on the
  /// room's thread and must not lock or wait.
  std::function<void(const Room&, LocalTime deadline)> on_step;

 private:
  ServerRooms& served();

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server

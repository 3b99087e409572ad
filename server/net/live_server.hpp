// A whole server in one object: sockets, session hub, rooms and their threads, for the program and for tests.
//
//   threads that step rooms                 io thread (run())
//   Room::answer() ──mailboxes, rings──▶     SessionHub::poll(): updates and answers go out
//        └──────── eventfd ─────────▶       wakes from sleep after an answer, or a few consecutive ones
//   ◀──mailboxes, rings──                   SessionHub::on_…: bytes and datagrams from the sockets
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
  std::string bind_address = "127.0.0.1";  ///< without `tls`: loopback only
  std::uint16_t port = 47800;              ///< TCP and UDP; 0: any
  int realtime_priority = 0;               ///< SCHED_FIFO of the room threads; 0: normal scheduler
  std::optional<Duration> duration{};      ///< stops automatically after this time
  /// SIGINT, SIGTERM and SIGHUP call stop(); SIGHUP not if it was ignored at the start.
  bool stops_on_signals = false;
  std::shared_ptr<const secure::TlsContext> tls{};  ///< null: nothing is encrypted
  HubSettings hub{};                                ///< an empty connection_ids is filled in
};

/// Counters of a server.
struct ServerFigures {
  HubCounters hub{};
  std::uint64_t failed_handshakes = 0;
  std::size_t connections = 0;                      ///< joined or not
  std::vector<std::array<std::size_t, 3>> users{};  ///< for each room, by UserRole
};

/// Liveness of a server.
struct ServerPulse {
  bool is_serving = false;  ///< run() has begun
  bool is_stopping = false;
  std::size_t users = 0;
  LocalTime io{};                  ///< last iteration of the io thread
  std::vector<LocalTime> rooms{};  ///< last iteration of each room: it has stepped, or found no users
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
  /// Adds a service of the rooms that is made after the server. Call before run(). Null is returned unchanged.
  template <class Service>
  Service* add(std::unique_ptr<Service> service) {
    return served().add(std::move(service));
  }

  /// Serves until stopped; the calling thread is the io thread. Call only once. When it returns or throws, all rooms
  /// have stopped and all services have finished.
  /// Fails   exception of the io thread, or else of a service's finish()
  void run();
  /// Refuses waiting requests, ends all connections and lets run() return within about 1.5 s.
  /// Thread  any
  void stop();
  /// Lets run() return at once without goodbyes, like a crash.
  /// Thread  any
  void abandon();

  // State while it runs, up to 0.1 s old; neither io nor rooms wait for the caller.
  /// Thread  any, but always the same for these two
  const ServerFigures& newest_figures();
  std::vector<RoomTiming> newest_timings();
  /// Thread  any
  ServerPulse pulse() const;

  // Results, for use after run().
  Duration up() const;
  const HubCounters& counters() const;
  std::uint64_t failed_handshakes() const;
  /// Timings in the order of the rooms.
  std::vector<RoomTiming> room_timings() const;

  /// Log sink. Set before run(); called on the io thread, must not block. Gets a line and its kind; there are few
  /// kinds.
  std::function<void(std::string_view kind, const std::string& line)> on_log;
  /// Called when the admission state changes (credentials, used tokens). Set before run(); called on the io thread,
  /// must not block.
  std::function<void(const wire::AdmissionState&)> on_admission;
  /// Called after a room's answer, before it is sent, while nothing else changes that room's world. Set before run();
  /// called on the room's thread, without lock or wait. `deadline`: time at which the step was due.
  std::function<void(const Room&, LocalTime deadline)> on_step;

 private:
  ServerRooms& served();

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::server

// A live client: the sockets, the io thread, and the Client that they drive. The haptic thread (haptic_loop.hpp) calls
// tick() of the same Client. The two threads share only the mailboxes of the Client.
//
//   haptic thread                        io thread (this file)
//   haptics().tick(), notify() ──eventfd▶ Client::poll(): encode, send
//   ◀──── inbox, scene, local model ───── sockets readable: check, decode, publish
//
// An eventfd wakes the io thread after each haptic tick. This costs one system call without a lock. If the io thread
// polled the outbox instead, each input would be delayed by up to the polling period. The io thread has a lower
// priority than the haptic thread, because a late haptic tick can be felt, but a late datagram is only a millisecond
// older.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.hpp"
#include "client/net/asio_client_transport.hpp"

namespace tandem::client {

struct ClientIoSettings {
  /// Without `trust`: a loopback address or "localhost". With `trust`: any address or a name.
  std::string host = "127.0.0.1";
  std::uint16_t port = 47800;
  /// Key or authorities that authenticate the server; empty: no TLS (--insecure)
  std::optional<secure::Trust> trust{};
  ClientSettings client;  ///< ClientIo always sets client.makes_models_aside to true
  std::optional<SimulatedLinks> links;
  /// SCHED_FIFO priority, which must be below that of the haptic thread; 0: normal scheduler
  int realtime_priority = 0;
  Resolve resolve = resolve_by_system;
  /// Called on the io thread after next() has new events. It must neither block nor throw.
  std::function<void()> on_events{};
};

/// Estimate of the server's clock and of the round trip to the server.
struct ClockEstimate {
  bool is_known = false;  ///< true: there is an estimate; false: all values are 0
  Duration offset{0};     ///< server time − local time
  Duration round_trip{0};
  Duration minimum_round_trip{0};
};

/// State of the rendering of the scene to the hand. Its members correspond to functions of the same names in Client.
struct RenderingStatus {
  StageSettings stage;
  std::string stage_note;
  std::string model_problem;
  std::optional<Duration> local_after;
  std::optional<Duration> full_local_after;
};

/// Copy of the session's state for threads other than the io thread.
struct ClientIoSnapshot {
  SessionStatus status;
  SessionCounters counters;
  bool has_state = false;  ///< result of ClientSession::has_state()
  ClockEstimate clock;
  LinkTraffic links;
  std::uint64_t asset_bytes = 0;               ///< size of the received and verified assets [bytes]
  std::shared_ptr<const wire::Joined> joined;  ///< answer to the last join; null before the first answer
  std::shared_ptr<const Credentials> beside;   ///< see ClientSession::credentials_beside()
  std::string room;                            ///< joined room; "" before the first welcome
  std::vector<std::string> rooms;              ///< names of the server's rooms
  HandStart hand_start;                        ///< see ClientSession::hand_start()
  bool has_nudges = true;                      ///< see ClientSession::has_nudges()
  /// Coupling coefficients of this user's tool, as last received from the server
  haptics::CouplingParameters coupling;
  std::string_view law;                                                ///< see ClientSession::law()
  std::shared_ptr<const std::vector<wire::KeptPose>> kept_poses;       ///< see ClientSession::kept_poses()
  std::optional<wire::PoseProgress> pose_progress;                     ///< see ClientSession::pose_progress()
  std::vector<std::pair<LocalTime, wire::Pointed>> pointed;            ///< see ClientSession::pointed()
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets;  ///< see ClientSession::soft_offsets()
  std::shared_ptr<const GameReport> game;                              ///< see ClientSession::game()
  CouplingCheck coupling_check;  ///< check of the present coupling, see CouplingWatch
  RenderingStatus rendering;
  std::uint64_t events_dropped = 0;        ///< events that the program did not read in time, see ClientIo::next()
  std::vector<wire::UserJoined> users;     ///< the other users in the room
  std::shared_ptr<const AssetMap> assets;  ///< assets of the scene that have been received; null before the first asset
};

class ClientIo {
 public:
  /// In      device  must outlive this object
  /// Fails   std::invalid_argument: `host` is not an address, or is an address that requires encryption; a link
  ///         parameter is invalid; or as in the constructor of Client. std::system_error: the sockets could not be
  ///         created
  ClientIo(ClientIoSettings settings, devices::Device& device);
  /// Calls stop().
  ~ClientIo();
  ClientIo(const ClientIo&) = delete;
  ClientIo& operator=(const ClientIo&) = delete;

  /// Replaces the token in the settings. Call it before start().
  void set_credentials(const Credentials& credentials);
  /// Starts the io thread, which then connects to the server.
  void start();
  /// Returns the core that the haptic thread must tick. After each tick, call notify().
  /// Thread  haptic
  HapticCore& haptics();
  const HapticCore& haptics() const;
  /// Wakes the io thread. Called after each haptic tick.
  /// Thread  haptic: one system call, which does not block
  void notify() noexcept;
  /// Queues a command for the io thread. Commands are executed soon, in the order of the calls.
  /// Fails   std::invalid_argument: an invalid stage, see Client::set_stage(), or an invalid LinkParameters::problem()
  /// Thread  any except haptic
  void send(Command command);
  /// Returns the next event; nothing if there is none. The effect of each returned event is included in snapshot(). At
  /// most 4096 events are queued (EventQueue). If the queue is full, the oldest event is dropped and counted
  /// (events_dropped).
  /// Thread  any except haptic, because it takes a lock
  std::optional<Event> next();
  /// Leaves the room and joins the thread. Waits up to 0.5 s for the leave message to be sent. Repeated calls have no
  /// effect.
  void stop();
  /// Returns the newest snapshot. It is at most 10 ms old, and is renewed at once when the session's state changes.
  /// Thread  any except haptic, because it takes a lock
  ClientIoSnapshot snapshot() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client

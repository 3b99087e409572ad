// A live client: the sockets, the io thread and the Client that they drive. The haptic thread (haptic_loop.hpp) ticks
// the same client. The two threads share its mailboxes only.
//
//   haptic thread                        io thread (this file)
//   haptics().tick(), notify() ──eventfd▶ Client::poll(): encode, send
//   ◀──── inbox, scene, local model ───── sockets readable: check, decode, publish
//
// An eventfd wakes the thread after each haptic tick (one write system call there, no lock). Polling the outbox instead
// would delay each input by up to the polling period. The thread runs below the haptic thread's priority: a late
// datagram costs a millisecond of age, a late haptic tick is felt.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.hpp"
#include "client/net/asio_client_transport.hpp"

namespace tandem::client {

struct ClientIoSettings {
  std::string host = "127.0.0.1";  ///< without `trust` a numeric loopback address or "localhost"; with it also a name
  std::uint16_t port = 47800;
  std::optional<secure::Trust> trust{};  ///< key or authorities to verify the server with; none: no TLS (--insecure)
  ClientSettings client;                 ///< makes_models_aside is always set
  std::optional<SimulatedLinks> links;
  int realtime_priority = 0;  ///< SCHED_FIFO, below the haptic thread's; 0: normal scheduler
  Resolve resolve = resolve_by_system;
};

/// Estimate of the server's clock and of the way to it.
struct ClockEstimate {
  bool is_known = false;  ///< false: the others are 0
  Duration offset{0};     ///< server − local
  Duration round_trip{0};
  Duration minimum_round_trip{0};
};

/// How the scene is rendered to the hand; see the functions of the same names in Client.
struct RenderingStatus {
  StageSettings stage;
  std::string stage_note;
  std::string model_problem;
  std::optional<Duration> local_after;
  std::optional<Duration> full_local_after;
};

/// Copy of the session's state for other threads.
struct ClientIoSnapshot {
  SessionStatus status;
  SessionCounters counters;
  bool has_state = false;  ///< ClientSession::has_state()
  ClockEstimate clock;
  LinkTraffic links;
  std::uint64_t asset_bytes = 0;               ///< fetched and verified assets [bytes]
  std::shared_ptr<const wire::Joined> joined;  ///< answer to the last join; null before the first
  std::shared_ptr<const Credentials> beside;   ///< ClientSession::credentials_beside()
  std::string room;                            ///< joined room; "" before the first welcome
  std::vector<std::string> rooms;              ///< rooms of the server
  HandStart hand_start;                        ///< ClientSession::hand_start()
  bool has_nudges = true;                      ///< ClientSession::has_nudges()
  haptics::CouplingParameters coupling;        ///< coupling of the user's own tool, as last received from the server
  std::string_view law;                        ///< ClientSession::law()
  std::shared_ptr<const std::vector<wire::KeptPose>> kept_poses;       ///< ClientSession::kept_poses()
  std::optional<wire::PoseProgress> pose_progress;                     ///< ClientSession::pose_progress()
  std::vector<std::pair<LocalTime, wire::Pointed>> pointed;            ///< ClientSession::pointed()
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets;  ///< ClientSession::soft_offsets()
  CouplingCheck coupling_check;                                        ///< result for the coupling in force
  RenderingStatus rendering;
  std::vector<wire::UserJoined> users;     ///< the other users in the room
  std::shared_ptr<const AssetMap> assets;  ///< assets of the scene received so far; null: none yet
};

class ClientIo {
 public:
  /// In      device  must outlive this
  /// Fails   std::invalid_argument: no address, an address that needs encryption, a bad link parameter, or as Client;
  ///         std::system_error: no sockets
  ClientIo(ClientIoSettings settings, devices::Device& device);
  /// Calls stop().
  ~ClientIo();
  ClientIo(const ClientIo&) = delete;
  ClientIo& operator=(const ClientIo&) = delete;

  /// Replaces the settings' token; call before start().
  void set_credentials(const Credentials& credentials);
  /// Starts the io thread, which connects.
  void start();
  /// Core that the haptic thread ticks; each tick is followed by notify().
  /// Thread  haptic
  HapticCore& haptics();
  const HapticCore& haptics() const;
  /// Wakes the io thread after a tick.
  /// Thread  haptic: one system call that cannot block
  void notify() noexcept;
  /// Performs a command soon, on the io thread. Commands are performed in the order in which they were sent.
  /// Fails   std::invalid_argument: a stage as for Client::set_stage(), or LinkParameters::problem()
  /// Thread  any but haptic
  void send(Command command);
  /// Returns the next event; nothing if there is none. snapshot() has the effect of each event that was returned. At
  /// most kMaxEvents wait; the oldest are dropped beyond it.
  /// Thread  any but haptic: takes a lock
  std::optional<Event> next();
  static constexpr std::size_t kMaxEvents = 4096;
  /// Leaves the room (waits up to 0.5 s until the leave message is sent) and joins the thread. Idempotent.
  void stop();
  /// Newest published snapshot: at most 10 ms old, renewed at once when the session's state changes.
  /// Thread  any but haptic: takes a lock
  ClientIoSnapshot snapshot() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client

// A client with its device and its haptic thread, for a program that calls it from any thread.
//
//   program's threads                       library's threads
//   snapshot, ticks ◀── mailbox, ring ───── haptic   HapticLoop, 1 kHz; never waits for the program
//   commands, events ◀── queues, eventfd ─▶ io       ClientIo
//
// Phases: open → join() → start() → stop(). stop() is possible in every phase and final.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/embed/settings.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"

namespace tandem::client::embed {

/// An eventfd that is readable while it is raised.
class Signal {
 public:
  /// Fails   std::system_error: no free descriptor
  Signal();
  ~Signal();
  Signal(const Signal&) = delete;
  Signal& operator=(const Signal&) = delete;

  void raise() noexcept;
  void lower() noexcept;
  /// Waits until the signal is raised. Returns false after the time-out.
  bool wait(Duration timeout) const noexcept;
  int descriptor() const noexcept { return descriptor_; }

 private:
  int descriptor_;
};

class EmbeddedClient {
 public:
  /// Opens the device.
  /// Fails   StatusError, std::invalid_argument or std::runtime_error with the remedy
  explicit EmbeddedClient(ClientConfig config);
  /// Calls close().
  ~EmbeddedClient();
  EmbeddedClient(const EmbeddedClient&) = delete;
  EmbeddedClient& operator=(const EmbeddedClient&) = delete;

  void join();
  /// Fails   StatusError: TANDEM_ENDED, TANDEM_TIMED_OUT, or TANDEM_BAD_HANDLE after close()
  void wait_joined(Duration timeout);
  void start();
  /// Ramps the force to zero, then leaves the room.
  void stop() noexcept;
  /// Begins to ramp the force to zero, without waiting.
  void begin_stop() noexcept;
  /// Ends the waits of other threads, and calls stop().
  void close() noexcept;

  /// Fails   StatusError: not joining, or stopped
  void send(Command command);
  StageSettings stage() const { return io_->snapshot().rendering.stage; }
  bool has_links() const { return has_links_; }
  /// Returns a place in the world for other users; if `body` is not 0, it moves with that body.
  /// Fails   StatusError: there is no such body
  wire::Point point_of(std::uint32_t body, const Vec3& place_W);

  tandem_session session() const;
  /// Returns nothing before the first tick.
  struct Newest {
    tandem_snapshot snapshot{};
    tandem_tick tick{};
  };
  std::optional<Newest> newest();
  std::vector<tandem_body> bodies();
  std::vector<tandem_user> users();
  bool pop(tandem_tick& tick);
  /// Returns the next event that has an equivalent in the C interface.
  std::optional<Event> next_event();
  /// Fails   StatusError: TANDEM_TIMED_OUT, or TANDEM_BAD_HANDLE after close()
  void wait_event(Duration timeout);
  int event_descriptor() const { return events_.descriptor(); }

 private:
  enum class Phase { kOpen, kJoining, kRunning, kStopped };

  ClientIoSettings with_signal(ClientIoSettings settings);

  int realtime_priority_;
  bool has_links_;
  Signal events_;
  std::string device_name_;
  std::shared_ptr<OwnDevice> own_device_;    ///< null if the library opened the device
  std::unique_ptr<devices::Device> device_;  ///< null if the program drives the device
  std::atomic<bool> is_closed_{false};
  std::atomic<Phase> phase_{Phase::kOpen};
  std::mutex lifecycle_;  ///< protects the changes of phase_
  mutable std::mutex notes_mutex_;
  std::string realtime_note_;  ///< refused real-time rights
  std::unique_ptr<ClientIo> io_;
  std::mutex view_mutex_;           ///< makes all readers of the view one reader
  mutable std::mutex ticks_mutex_;  ///< makes all readers of the ring one reader; protects the pointer `loop_`
  std::unique_ptr<HapticLoop> loop_;
};

}  // namespace tandem::client::embed

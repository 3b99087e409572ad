// A client with its device and its haptic thread, which the threads of another program can call.
//
//   program's threads                       library's threads
//   snapshot, ticks ◀── mailbox, ring ───── haptic   HapticLoop, 1 kHz; never waits for the program
//   commands, events ◀── queues, eventfd ─▶ io       ClientIo
//
// Phases: open → join() → start() → stop(). stop() is possible in every phase and ends the client for good.
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

/// A signal between threads, implemented by an eventfd. The eventfd is readable while the signal is raised.
class Signal {
 public:
  /// Fails   std::system_error: no file descriptor is free
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
  /// Opens the device, but does not connect.
  /// Fails   StatusError, std::invalid_argument or std::runtime_error if the settings are invalid or the device cannot
  ///         be opened; the message names the remedy
  explicit EmbeddedClient(ClientConfig config);
  /// Calls close().
  ~EmbeddedClient();
  EmbeddedClient(const EmbeddedClient&) = delete;
  EmbeddedClient& operator=(const EmbeddedClient&) = delete;

  void join();
  /// Fails   StatusError with the status TANDEM_ENDED (the session has ended), TANDEM_TIMED_OUT, or TANDEM_BAD_HANDLE
  ///         (after close())
  void wait_joined(Duration timeout);
  void start();
  /// Ramps the force to zero, then leaves the room.
  void stop() noexcept;
  /// Starts to ramp the force to zero, and returns at once.
  void begin_stop() noexcept;
  /// Makes waiting calls of other threads return, and calls stop().
  void close() noexcept;

  /// Fails   StatusError: join() was not called yet, or the client is stopped
  void send(Command command);
  StageSettings stage() const { return io_->snapshot().rendering.stage; }
  bool has_links() const { return has_links_; }
  /// Returns the message with which this user points at a position in the world. If `body` is not 0, the position moves
  /// with that body.
  /// Fails   StatusError: a body with this id does not exist
  wire::Point point_of(std::uint32_t body, const Vec3& place_W);

  tandem_session session() const;
  /// Newest state of the room and its tick; newest() returns nothing before the first tick.
  struct Newest {
    tandem_snapshot snapshot{};
    tandem_tick tick{};
  };
  std::optional<Newest> newest();
  std::vector<tandem_body> bodies();
  std::vector<tandem_user> users();
  bool pop(tandem_tick& tick);
  /// Returns the next event that the C interface can represent. Events of other kinds are skipped.
  std::optional<Event> next_event();
  /// Fails   StatusError with the status TANDEM_TIMED_OUT, or TANDEM_BAD_HANDLE (after close())
  void wait_event(Duration timeout);
  int event_descriptor() const { return events_.descriptor(); }

 private:
  enum class Phase { kOpen, kJoining, kRunning, kStopped };

  ClientIoSettings with_signal(ClientIoSettings settings);

  int realtime_priority_;
  bool has_links_;
  Signal events_;
  std::string device_name_;
  std::shared_ptr<OwnDevice> own_device_;    ///< device that the program drives; null if the library opened a device
  std::unique_ptr<devices::Device> device_;  ///< device that the library opened; null if the program drives the device
  std::atomic<bool> is_closed_{false};
  std::atomic<Phase> phase_{Phase::kOpen};
  std::mutex lifecycle_;  ///< protects the changes of phase_
  mutable std::mutex notes_mutex_;
  std::string realtime_note_;  ///< text about the real-time rights that the system refused
  std::unique_ptr<ClientIo> io_;
  std::mutex view_mutex_;           ///< only one thread at a time may read the view
  mutable std::mutex ticks_mutex_;  ///< serialises the readers of the ring of ticks; protects the pointer `loop_`
  std::unique_ptr<HapticLoop> loop_;
};

}  // namespace tandem::client::embed

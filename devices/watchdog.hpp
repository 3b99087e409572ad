// Writes zero to a device when this program cannot: stopped (SIGSTOP, a debugger), killed, or crashed.
//
//   this process                          tandem-watchdog, one per device
//   ────────────                          ──────────────────────────────────────
//   beat() each step ──shared memory──▶   each 5 ms: last beat with a force older than 50 ms?  then zero, five times
//   has_released_force() ◀─shared memory─                  has this process ended?             then zero, and exit
//   send()          ──packets───────▶     for a byte stream: the only writer; writes each frame whole
//                                         owns only the device's descriptor and the bytes of its zero
//
// 1. The device's descriptor is inherited, not opened again: the kernel grants a claimed USB interface to an open file,
//    whichever process holds it. Thus zero can be written while the owner is stopped. After the owner's death the
//    interface stays claimed until zero is written; a socket likewise stays connected.
// 2. A separate program shares none of this one's memory, threads and signals. Its own session keeps signals of a
//    terminal away.
// 3. It acts only while a force is on: a device that is opened, homed or at zero force may be slow.
// 4. A zero counts once the device has accepted it. Otherwise it is retried while the owner exists, and for 10 s after
//    the owner's end. It is withdrawn when the owner resumes before its first byte is sent.
// 5. A frame is written whole or not at all. A USB transfer and a write of up to PIPE_BUF bytes to a pipe are atomic;
//    the owner writes those itself. On a TCP stream a write may be partial, and an owner that is killed or stopped
//    during it leaves an unknown part of its frame. There all frames pass through the watchdog (send()), which
//    completes each before the next. A force sent before the owner was informed of a zero is replaced by zero (fencing
//    token: releases).
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::devices {

inline constexpr std::size_t kMaxFrameBytes = 512;

/// Command that sets the device's force to zero.
struct ZeroCommand {
  int descriptor = -1;                         ///< open while the watchdog has it
  std::optional<std::uint8_t> usb_endpoint{};  ///< usbfs bulk-out endpoint; none: write(2)
  std::vector<std::uint8_t> bytes;             ///< 1 to kMaxFrameBytes
};
/// Writes zero; waits at most 20 ms. False: the device did not accept all of it.
bool send_zero(const ZeroCommand& zero) noexcept;

/// Memory shared by both processes.
struct WatchdogBeat {
  std::atomic<std::int64_t> at_ns{0};  ///< LocalTime of the last beat
  std::atomic<bool> is_force_on{false};
  std::atomic<std::uint32_t> releases{0};  ///< number of silences in which the device accepted a zero
  std::atomic<std::uint32_t> written{0};   ///< number of the last written command of send()
  std::atomic<bool> is_in_frame{false};    ///< a frame may be partly written
};

/// Header of each packet of send(); the frame's bytes follow.
struct WatchdogFrameHead {
  std::uint32_t number = 0;          ///< number of the command; 0: a reply of the protocol
  std::uint32_t known_releases = 0;  ///< WatchdogBeat::releases as known to the owner when it chose the force
  std::uint32_t is_force_on = 0;
};

class Watchdog {
 public:
  static constexpr Duration kMaxSilence{std::chrono::milliseconds(50)};

  /// In      program   file of the watchdog
  ///         priority  as for request_realtime()
  /// Fails   std::runtime_error: no such program, with the remedy; std::system_error: no shared memory
  explicit Watchdog(int realtime_priority, std::filesystem::path program = default_program());
  /// Calls release().
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// $TANDEM_WATCHDOG, else `tandem-watchdog` beside the running program.
  static std::filesystem::path default_program();

  /// Starts a watchdog process that writes this zero, and releases the previous one. False: no process could be
  /// started.
  bool watch_over(const ZeroCommand& zero);
  /// Ends the watchdog; if a force is on, after its zero is written. Call it before the descriptor is closed. Waits up
  /// to 0.5 s; a watchdog whose device accepts nothing continues alone for up to 10 s.
  void release();

  /// Call it before choosing a command. A later let-go, of which the choice took no account, makes the command
  /// obsolete.
  /// Thread  the thread of the commands
  void begin_command() noexcept { known_releases_ = seen_.load(std::memory_order_acquire); }
  bool is_command_obsolete() const noexcept {
    return beat_->releases.load(std::memory_order_acquire) != known_releases_;
  }
  /// Call it before each command and after its delivery: at most 20 ms apart while a force may be on.
  /// Thread  the thread of the commands
  void beat(LocalTime now, bool is_force_on) noexcept;
  /// The device has accepted a zero of the watchdog since the last call.
  /// Thread  one
  bool has_released_force() noexcept;

  /// Sends a frame of a command for the device's stream. While the stream is blocked the newest command replaces a
  /// waiting one. Zero replaces an obsolete force.
  /// Out     false: too long, or the watchdog has ended or does not read
  /// Thread  the thread of the commands
  bool send(std::span<const std::uint8_t> frame, bool is_force_on) noexcept;
  /// Sends a frame that answers the peer's protocol (a pong); commands have priority.
  bool send_reply(std::span<const std::uint8_t> frame) noexcept;
  /// The watchdog was killed or has failed: it writes nothing more.
  bool has_ended() const noexcept;
  /// The last frame of send(), or a zero in its place, is written completely.
  bool is_written() const noexcept;

 private:
  bool send_packet(const WatchdogFrameHead& head, std::span<const std::uint8_t> frame) noexcept;
  void await_end();
  void forget_ended();

  std::filesystem::path program_;
  std::string priority_;
  int memory_ = -1;
  WatchdogBeat* beat_ = nullptr;
  ZeroCommand zero_;
  std::atomic<std::uint32_t> seen_{0};  ///< value of WatchdogBeat::releases at the last has_released_force()
  std::uint32_t known_releases_ = 0;
  std::uint32_t sent_ = 0;  ///< number of the last command of send()
  int lifeline_ = -1;       ///< packets to the watchdog, which detects its closing
  pid_t process_ = -1;
  std::vector<pid_t> ending_;  ///< released processes that have not ended yet
};

}  // namespace tandem::devices

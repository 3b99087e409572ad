// Writes zero force to a device when this program cannot do so, because it is stopped (SIGSTOP, a debugger), killed or
// crashed.
//
//   this process                          tandem-watchdog, one per device
//   ────────────                          ──────────────────────────────────────
//   beat() each step ──shared memory──▶   each 5 ms: last beat with a force older than 50 ms?  then zero, five times
//   has_released_force() ◀─shared memory─                  has this process ended?             then zero, and exit
//   send()          ──packets───────▶     for a byte stream: the only writer; writes each frame whole
//                                         owns only the device's descriptor and the bytes of its zero command
//
// 1. The watchdog inherits the device's descriptor, so that it can write zero while the owner (this process) is
//    stopped. It could not open the device itself, because the kernel grants a claimed USB interface to one open file.
//    After the owner has ended, the inherited descriptor keeps the interface claimed, or the socket connected, until
//    zero is written.
// 2. The watchdog is a separate program. Apart from the memory shown above, it shares no memory, threads or signals
//    with this process. It runs in a separate session, so that signals of a terminal do not reach it.
// 3. The watchdog writes zero only if a force is displayed. Without a force, long pauses between beats are normal, for
//    example during opening and homing.
// 4. A zero counts as written when the device has accepted it. Until then it is retried: while the owner exists, and
//    for 10 s after the owner has ended. If the owner resumes before the first byte of the zero is sent, the zero is
//    cancelled.
// 5. Frames must be written completely or not at all.
//    * USB transfers, and writes of up to PIPE_BUF bytes to a pipe, are atomic. The owner performs them itself.
//    * On a TCP stream a write may be partial: an owner that is killed or stopped during a write leaves an unknown part
//      of its frame. Therefore all frames for a TCP stream pass through the watchdog (send()), which completes each
//      frame before the next.
// 6. An owner that resumes may send a force that it chose before it was informed of a zero. The watchdog replaces this
//    force by zero. It recognises the force by the number `releases` in its packet (a fencing token).
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

/// Command that sets the force of the device to zero.
struct ZeroCommand {
  int descriptor = -1;                         ///< device; must stay open while the watchdog uses the command
  std::optional<std::uint8_t> usb_endpoint{};  ///< bulk-out endpoint for usbfs; empty: write(2) is used
  std::vector<std::uint8_t> bytes;             ///< bytes of the command; 1 to kMaxFrameBytes
};
/// Writes the zero command; waits at most 20 ms. Returns false if the device did not accept all of it.
bool send_zero(const ZeroCommand& zero) noexcept;

/// Memory shared by the owner (the program that uses the device) and the watchdog.
struct WatchdogBeat {
  std::atomic<std::int64_t> at_ns{0};  ///< time of the last beat [ns], as LocalTime
  std::atomic<bool> is_force_on{false};
  std::atomic<std::uint32_t> releases{0};  ///< number of silences of the owner in which a zero was accepted
  std::atomic<std::uint32_t> written{0};   ///< number of the last command of send() that was written to the device
  std::atomic<bool> is_in_frame{false};    ///< true while a frame may be written only in part
};

/// Header of each packet that send() sends to the watchdog; the bytes of the frame follow it.
struct WatchdogFrameHead {
  std::uint32_t number = 0;  ///< number of the command; 0: no command, but a reply that the protocol requires
  /// Value of WatchdogBeat::releases that the owner had read before it chose the force of this command
  std::uint32_t known_releases = 0;
  std::uint32_t is_force_on = 0;
};

class Watchdog {
 public:
  static constexpr Duration kMaxSilence{std::chrono::milliseconds(50)};

  /// In      realtime_priority  priority of the watchdog, see request_realtime()
  ///         program            file of the watchdog program
  /// Fails   std::runtime_error: the program does not exist; the message has the remedy. std::system_error: no shared
  ///         memory
  explicit Watchdog(int realtime_priority, std::filesystem::path program = default_program());
  /// Ends the watchdog by release().
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// Returns $TANDEM_WATCHDOG if it is set, otherwise `tandem-watchdog` in program_folder().
  static std::filesystem::path default_program();

  /// Starts a watchdog process for this zero command, after ending the previous process. Returns false if the process
  /// could not be started.
  bool watch_over(const ZeroCommand& zero);
  /// Ends the watchdog process, and waits for its end for up to 0.5 s. If a force is displayed, the process first
  /// writes zero. If the device accepts nothing, the process continues alone for up to 10 s. Call this function before
  /// the descriptor of the device is closed.
  void release();

  /// Must be called before the haptic loop's command is chosen. If the watchdog writes zero after this call, the chosen
  /// command counts as obsolete.
  /// Thread  the thread that sends the commands
  void begin_command() noexcept { known_releases_ = seen_.load(std::memory_order_acquire); }
  bool is_command_obsolete() const noexcept {
    return beat_->releases.load(std::memory_order_acquire) != known_releases_;
  }
  /// Reports that this program is running (a beat). Must be called before each command and after its delivery. While a
  /// force may be displayed, the calls must be at most 20 ms apart.
  /// Thread  the thread that sends the commands
  void beat(LocalTime now, bool is_force_on) noexcept;
  /// Returns whether the device has accepted a zero of the watchdog since the last call.
  /// Thread  always the same thread
  bool has_released_force() noexcept;

  /// Passes a frame with a command to the watchdog, which writes it to the device's stream. If an earlier command is
  /// still waiting because the stream is blocked, the new one replaces it. An obsolete force is replaced by zero.
  /// Out     false: the frame is too long, or the watchdog has ended or does not read
  /// Thread  the thread that sends the commands
  bool send(std::span<const std::uint8_t> frame, bool is_force_on) noexcept;
  /// Passes a reply that the protocol of the stream requires (a pong) to the watchdog. Commands are written before
  /// replies.
  bool send_reply(std::span<const std::uint8_t> frame) noexcept;
  /// Returns whether the watchdog was killed or has failed, so that it writes nothing more.
  bool has_ended() const noexcept;
  /// Returns whether the last frame of send(), or the zero that replaced it, was written completely.
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
  std::uint32_t sent_ = 0;  ///< number of the last command passed to send()
  int lifeline_ = -1;       ///< socket for packets to the watchdog; closing it makes the watchdog end
  pid_t process_ = -1;
  std::vector<pid_t> ending_;  ///< released processes that have not terminated yet
};

}  // namespace tandem::devices

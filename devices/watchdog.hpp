// Writes zero to a device when this program cannot: stopped (SIGSTOP, a debugger), killed, or crashed.
//
//   this process                          tandem-watchdog, one a device
//   ────────────                          ──────────────────────────────────────
//   beat() each step ──shared memory──▶   each 5 ms: is the last beat with a force older than 50 ms?  then zero, five times
//   has_let_go()    ◀──shared memory──                                    the end of this process?   then zero, and ends
//   send()          ──packets───────▶     of a byte stream: the only writer; each frame goes out whole
//                                         owns nothing but the device's descriptor and the bytes of its zero
//
// 1. The device's descriptor is inherited, not opened again: the kernel gives a claimed USB interface to an open file,
//    whichever process holds it. So zero goes through while the owner is stopped, and the interface stays claimed after its
//    death until zero is written; a socket likewise stays connected.
// 2. A program of its own, so that it has none of this one's memory, threads and signals; in a session of its own, so that
//    signals of a terminal do not reach it.
// 3. It acts only while a force is on: a device that is opened, homed or given zero may take its time.
// 4. Zeros count once the device has taken them. One that it does not take is retried as long as the owner exists, and for 10 s after
//    the owner's end; it is withdrawn when the owner goes on before its first byte is out.
// 5. A frame is written whole or not at all. A USB transfer and a write of up to PIPE_BUF bytes to a pipe are atomic, and the
//    owner writes those itself. On a TCP stream a write may be partial, and an owner that is killed or stopped inside it
//    leaves an unknown part of its frame: there all frames go through the watchdog (send()), which completes each
//    before the next. A force that was sent before the owner knew of a zero is replaced by zero (fencing token: let_go).
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

/// The command that makes a device show no force.
struct ZeroCommand {
  int descriptor = -1;                         ///< open, as long as the watchdog has it
  std::optional<std::uint8_t> usb_endpoint{};  ///< of usbfs, bulk out; none: write(2)
  std::vector<std::uint8_t> bytes;             ///< 1 to kMaxFrameBytes
};
/// Waits at most 20 ms. False: the device did not take all of it.
bool say_zero(const ZeroCommand& zero) noexcept;

/// Memory that both processes share.
struct WatchdogBeat {
  std::atomic<std::int64_t> at_ns{0};  ///< LocalTime of the last beat
  std::atomic<bool> is_force_on{false};
  std::atomic<std::uint32_t> let_go{0};   ///< silences for which the device has taken a zero
  std::atomic<std::uint32_t> written{0};  ///< number of the last command of send() that is out
  std::atomic<bool> is_in_frame{false};   ///< a frame may be out in part
};

/// Begins each packet of send(); the frame's bytes follow.
struct WatchdogFrameHead {
  std::uint32_t number = 0;        ///< of a command; 0: a reply of the protocol
  std::uint32_t let_go_known = 0;  ///< WatchdogBeat::let_go as the owner knew it when it chose the force
  std::uint32_t is_force_on = 0;
};

class Watchdog {
 public:
  static constexpr Duration kMaxSilence{std::chrono::milliseconds(50)};

  /// In      program  of the watchdog; priority as request_realtime() has it
  /// Fails   std::runtime_error: no such program, with the remedy; std::system_error: no shared memory
  explicit Watchdog(int realtime_priority, std::filesystem::path program = default_program());
  /// As release().
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// $TANDEM_WATCHDOG, else `tandem-watchdog` beside the running program.
  static std::filesystem::path default_program();

  /// From now on this is the zero that it writes, instead of the one before. False: no process could be started.
  bool watch_over(const ZeroCommand& zero);
  /// The watchdog ends; if a force is on, once its zero is out. To be called before the descriptor is closed. Waits up to
  /// 0.5 s; a watchdog whose device takes nothing goes on for up to 10 s by itself.
  void release();

  /// Before a command is chosen. A let-go that this thread could not have known of when it chose makes the command obsolete.
  /// Thread  of the commands
  void begin_command() noexcept { let_go_known_ = seen_.load(std::memory_order_acquire); }
  bool is_command_obsolete() const noexcept { return beat_->let_go.load(std::memory_order_acquire) != let_go_known_; }
  /// Before each command and after its delivery: at most 20 ms apart while a force may be on.
  /// Thread  of the commands
  void beat(LocalTime now, bool is_force_on) noexcept;
  /// The device has taken a zero of the watchdog since the last call.
  /// Thread  one
  bool has_let_go() noexcept;

  /// Writes a frame of a command to the device's stream. While the stream takes nothing the newest command replaces one
  /// that waits. In the place of an obsolete force zero is written.
  /// Out     false: too long, or the watchdog has ended or does not read
  /// Thread  of the commands
  bool send(std::span<const std::uint8_t> frame, bool is_force_on) noexcept;
  /// Likewise a frame that answers the peer's protocol (a pong); it waits for the commands.
  bool send_reply(std::span<const std::uint8_t> frame) noexcept;
  /// It was killed, or has ended by a fault: nothing more is written.
  bool has_ended() const noexcept;
  /// The last frame of send(), or a zero in its place, is out whole.
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
  std::atomic<std::uint32_t> seen_{0};  ///< of WatchdogBeat::let_go, by has_let_go()
  std::uint32_t let_go_known_ = 0;
  std::uint32_t sent_ = 0;  ///< number of the last command of send()
  int lifeline_ = -1;       ///< packets to the watchdog, which sees its end
  pid_t process_ = -1;
  std::vector<pid_t> ending_;  ///< released, and not ended yet
};

}  // namespace tandem::devices

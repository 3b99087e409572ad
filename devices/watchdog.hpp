// Says zero to a device when this program cannot: stopped (SIGSTOP, a debugger), killed, or crashed.
//
//   this process                          tandem-watchdog, one a device
//   ────────────                          ──────────────────────────────────────
//   beat() each step ──shared memory──▶   each 5 ms: is the last beat with a force older than 50 ms?  then zero, five times
//   has_let_go()    ◀──shared memory──                                    the end of this process?   then zero, and ends
//                                         owns nothing but the device's descriptor and the bytes of its zero
//
// 1. The device's descriptor is inherited, not opened again: the kernel gives a claimed USB interface to an open file,
//    whichever process holds it. So zero goes through while the owner stands still, and the interface stays claimed after its
//    death until zero is said; a socket likewise stays connected.
// 2. A program of its own, so that it has none of this one's memory, threads and signals; in a session of its own, so that
//    what a terminal sends does not reach it.
// 3. It acts only while a force is on: a device that is opened, homed or given zero may take its time.
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

inline constexpr std::size_t kMaxZeroBytes = 512;

/// How a device is told to let go.
struct ZeroCommand {
  int descriptor = -1;                         ///< open, as long as the watchdog has it
  std::optional<std::uint8_t> usb_endpoint{};  ///< of usbfs, bulk out; none: write(2)
  std::vector<std::uint8_t> bytes;             ///< 1 to kMaxZeroBytes
};
/// Waits at most 20 ms. False: the device did not take it.
bool say_zero(const ZeroCommand& zero) noexcept;

/// What both processes share.
struct WatchdogBeat {
  std::atomic<std::int64_t> at_ns{0};  ///< LocalTime of the last beat
  std::atomic<bool> is_force_on{false};
  std::atomic<std::uint32_t> let_go{0};  ///< how often zero was said for a silence
};

class Watchdog {
 public:
  static constexpr Duration kMaxSilence{std::chrono::milliseconds(50)};

  /// In      program  of the watchdog; priority as request_realtime() has it
  /// Fails   std::runtime_error: no such program, with the remedy; std::system_error: no shared memory
  explicit Watchdog(int realtime_priority, std::filesystem::path program = default_program());
  /// The watchdog ends; it says zero if a force is on.
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  /// $TANDEM_WATCHDOG, else `tandem-watchdog` beside the running program.
  static std::filesystem::path default_program();

  /// From now on this is what it says, instead of what was watched over before. False: no process could be started.
  bool watch_over(const ZeroCommand& zero);
  /// What is watched over is about to be closed.
  void release();
  /// Before each command: at most 20 ms apart while a force is on.
  /// Thread  of the commands
  void beat(LocalTime now, bool is_force_on) noexcept;
  /// It has said zero since the last call.
  /// Thread  one
  bool has_let_go() noexcept;

 private:
  std::filesystem::path program_;
  std::string priority_;
  int memory_ = -1;
  WatchdogBeat* beat_ = nullptr;
  std::uint32_t seen_ = 0;
  int lifeline_ = -1;  ///< the watchdog sees its end
  pid_t process_ = -1;
};

}  // namespace tandem::devices

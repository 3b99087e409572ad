// Command line of the program tandem-watchdog: PRIORITY, ENDPOINT ("-" if there is none), and the bytes of the zero
// command in hexadecimal. The program inherits the descriptors below.
#pragma once

namespace tandem::devices::watchdog_program {

inline constexpr int kDevice = 3;
inline constexpr int kMemory = 4;  ///< shared memory with a WatchdogBeat
/// Socket for packets of Watchdog::send(). When the peer closes it, the owner has ended.
inline constexpr int kOwner = 5;
inline constexpr int kFirstFree = 6;

}  // namespace tandem::devices::watchdog_program

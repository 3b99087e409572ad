// What tandem-watchdog is started with: PRIORITY, ENDPOINT ("-": none) and the bytes of zero in hex; and these descriptors.
#pragma once

namespace tandem::devices::watchdog_program {

inline constexpr int kDevice = 3;
inline constexpr int kMemory = 4;    ///< of a WatchdogBeat
inline constexpr int kLifeline = 5;  ///< a pipe that ends when the owner does
inline constexpr int kFirstFree = 6;

}  // namespace tandem::devices::watchdog_program

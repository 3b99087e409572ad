// The arguments of tandem-watchdog are PRIORITY, ENDPOINT ("-": none) and the bytes of zero in hex. It inherits these
// descriptors.
#pragma once

namespace tandem::devices::watchdog_program {

inline constexpr int kDevice = 3;
inline constexpr int kMemory = 4;  ///< memory of a WatchdogBeat
inline constexpr int kOwner = 5;   ///< packets of Watchdog::send(); closed when the owner ends
inline constexpr int kFirstFree = 6;

}  // namespace tandem::devices::watchdog_program

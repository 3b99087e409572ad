// Interface of the program tandem-watchdog. Its arguments are PRIORITY, ENDPOINT ("-" if there is none) and the bytes
// of the zero command in hexadecimal. It inherits the following descriptors.
#pragma once

namespace tandem::devices::watchdog_program {

inline constexpr int kDevice = 3;
inline constexpr int kMemory = 4;  ///< shared memory with a WatchdogBeat
inline constexpr int kOwner = 5;   ///< socket for packets of Watchdog::send(); closed at the owner's end
inline constexpr int kFirstFree = 6;

}  // namespace tandem::devices::watchdog_program

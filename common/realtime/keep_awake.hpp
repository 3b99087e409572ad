// A processor that does not sleep, for a loop that must wake up in time on a virtual machine.
#pragma once

#include <filesystem>
#include <thread>

namespace tandem::realtime {

/// Whether an idle processor of this machine is given back to a host, which may take a millisecond until it runs again: the
/// machine is virtual, and its kernel has no idle driver that request_realtime() could ask to stay awake.
///
/// In      root  under which proc/cpuinfo and sys/devices/system/cpu/cpuidle/current_driver are; elsewhere in a test
bool gives_idle_to_host(const std::filesystem::path& root = "/");

/// Starts a thread at SCHED_IDLE, the lowest priority there is, that never sleeps, on the processor that the calling thread
/// runs on; it follows within 10 ms where that goes to. Whatever else is to run there runs before it, as if the processor
/// were idle; the host gives it a whole processor's time.
///
/// Out     ends when it is destroyed, or the calling thread does; at once where SCHED_IDLE is refused
std::jthread keep_awake();

}  // namespace tandem::realtime

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
/// Whether this process may use a share of the processors only, as in a container: what never sleeps would use it up.
///
/// In      root  under which proc/self/cgroup and sys/fs/cgroup are
bool has_processor_quota(const std::filesystem::path& root = "/");
/// Whether keep_awake() is worth its price for the calling thread: it has real-time priority, the host takes idle processors,
/// and there is no quota.
bool should_keep_awake();

/// Starts a thread at SCHED_IDLE, the lowest priority there is, that never sleeps, on the processor that the calling thread
/// runs on; it follows within 10 ms where that goes to. Whatever else is to run there runs before it, as if the processor
/// were idle; where the kernel shares processors out by group (cgroups, sessions) it stops for a second at a time while
/// others keep the processor awake. The host gives it a whole processor's time.
///
/// Out     ends when it is destroyed, or the calling thread does; at once where SCHED_IDLE is refused
std::jthread keep_awake();

}  // namespace tandem::realtime

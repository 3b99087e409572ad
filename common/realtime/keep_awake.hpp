// A processor that does not sleep, for a loop that must wake up in time on a virtual machine.
#pragma once

#include <filesystem>
#include <memory>

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

/// Starts a thread at SCHED_IDLE, the lowest priority there is, that keeps the processor awake that the calling thread runs on,
/// and follows it within 10 ms. Whatever else is to run there runs before it, as if the processor were idle. Where the kernel
/// shares processors out by group (cgroups, sessions) that is not so: it stops for a second at a time while others have the
/// processor for more than half of the time (as /proc/self/schedstat counts it; without that file never). The host gives it a
/// whole processor's time. Of several in a process, one keeps a processor awake.
///
/// Out     it ends, within some time of its own, when nobody holds this any more, or with the calling thread; empty where
///         there can be no such thread
std::shared_ptr<const void> keep_awake();

}  // namespace tandem::realtime

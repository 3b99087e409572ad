// Keeps a processor from idling, for a loop that must wake up in time on a virtual machine.
#pragma once

#include <filesystem>
#include <memory>

namespace tandem::realtime {

/// Returns whether an idle processor goes back to a host, which may need a millisecond to run it again. This holds if
/// the machine is virtual and its kernel has no idle driver that request_realtime() could keep awake.
///
/// In      root  contains proc/cpuinfo and sys/devices/system/cpu/cpuidle/current_driver; tests use another one
bool gives_idle_to_host(const std::filesystem::path& root = "/");
/// Returns whether this process may use only a share of the processors, as in a container. A thread that never sleeps
/// would use up that share.
///
/// In      root  contains proc/self/cgroup and sys/fs/cgroup
bool has_processor_quota(const std::filesystem::path& root = "/");
/// Returns whether keep_awake() is worthwhile for the calling thread: it has real-time priority, the host takes idle
/// processors, and there is no quota.
bool should_keep_awake();

/// Starts a thread at SCHED_IDLE, the lowest priority, on the processor of the calling thread. It keeps that processor
/// awake and follows the thread within 10 ms. Any other work there runs first, as if the processor were idle. This does
/// not hold where the kernel shares processors by group (cgroups, sessions). The thread therefore pauses for a second
/// whenever others have the processor for more than half of the time (measured by /proc/self/schedstat; without that
/// file never). The host grants a whole processor's time. Of several such threads in a process, one keeps a processor
/// awake.
///
/// Out     handle of the thread, which ends some time after the last copy is destroyed or the calling thread ends;
///         empty if such a thread is not possible
std::shared_ptr<const void> keep_awake();

}  // namespace tandem::realtime

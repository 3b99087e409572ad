// Prevents a processor of a virtual machine from becoming idle, so that a real-time loop wakes up in time.
#pragma once

#include <filesystem>
#include <memory>

namespace tandem::realtime {

/// Returns whether the guest system hands an idle processor back to the host of the virtual machine. The host may need
/// a millisecond to run the processor again. This is the case if the machine is virtual and its kernel has no idle
/// driver that request_realtime() could configure.
///
/// In      root  folder with proc/cpuinfo and sys/devices/system/cpu/cpuidle/current_driver; tests pass a folder of
///         their own
bool gives_idle_to_host(const std::filesystem::path& root = "/");
/// Returns whether a quota limits the processor time of this process, as in a container. With a quota, keep_awake()
/// must not be used, because its helper never sleeps and would use up the quota.
///
/// In      root  folder with proc/self/cgroup and sys/fs/cgroup
bool has_processor_quota(const std::filesystem::path& root = "/");
/// Returns whether keep_awake() is useful for the calling thread: the thread has real-time priority, idle processors
/// are handed back to a host, and there is no quota.
bool should_keep_awake();

/// Starts a helper thread that keeps the processor of the calling thread busy, so that the host does not suspend this
/// processor. The helper has the lowest priority (SCHED_IDLE). If the calling thread moves to a different processor,
/// the helper follows it within 10 ms. If several helpers of a process run on one processor, only one of them is
/// active.
///
/// All other threads of its group preempt the helper. A kernel that shares processor time by group (cgroups, sessions)
/// still lets the helper take time from threads of other groups. For this reason the helper pauses for a second
/// whenever other threads use more than half of the processor's time. It reads their time from /proc/self/schedstat.
/// Without that file it never pauses.
///
/// Out     handle of the helper; empty if the helper cannot be started. The helper ends soon after the last copy of the
///         handle is destroyed or the calling thread ends
std::shared_ptr<const void> keep_awake();

}  // namespace tandem::realtime

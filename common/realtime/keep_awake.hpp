// Prevents a processor of a virtual machine from becoming idle, so that a real-time loop wakes up in time.
#pragma once

#include <filesystem>
#include <memory>

namespace tandem::realtime {

/// Returns whether an idle processor is handed back to the host of a virtual machine, which may need a millisecond to
/// run the processor again. This is so if the machine is virtual and its kernel has no idle driver that
/// request_realtime() could configure.
///
/// In      root  folder with proc/cpuinfo and sys/devices/system/cpu/cpuidle/current_driver; tests pass a folder of
///         their own
bool gives_idle_to_host(const std::filesystem::path& root = "/");
/// Returns whether a quota limits the processor time of this process, as in a container. A helper that never sleeps
/// would use up the quota.
///
/// In      root  folder with proc/self/cgroup and sys/fs/cgroup
bool has_processor_quota(const std::filesystem::path& root = "/");
/// Returns whether keep_awake() is useful for the calling thread: the thread has real-time priority, idle processors
/// are handed back to a host, and there is no quota.
bool should_keep_awake();

/// Starts a helper thread on the processor of the calling thread, at the lowest priority (SCHED_IDLE). The helper keeps
/// the processor busy, so that to the host it appears fully used. It follows the calling thread within 10 ms to a
/// different processor. If several helpers of a process run on one processor, only one of them keeps it busy.
///
/// All other threads preempt the helper. But a kernel that shares processor time by group (cgroups, sessions) lets the
/// helper take time from threads of other groups. The helper therefore pauses for a second whenever other threads use
/// more than half of the processor's time. It reads this from /proc/self/schedstat; without that file it never pauses.
///
/// Out     handle of the helper, which ends some time after the last copy is destroyed or the calling thread ends;
///         empty if the helper cannot be started
std::shared_ptr<const void> keep_awake();

}  // namespace tandem::realtime

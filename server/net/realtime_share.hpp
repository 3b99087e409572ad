// Selects the threads of a server that get real-time priority, such that the kernel never has to throttle all of them.
#pragma once

#include <cstddef>
#include <vector>

namespace tandem::server {

/// Distributes real-time priority among threads.
/// * The first thread (the io thread) always has it.
/// * The other threads get it in ascending order of demand, as long as two limits hold: each of them needs at most 93 %
///   of a core, and all together need at most 93 % of `cores` cores.
/// * A thread that has lost priority regains it only below 85 % (hysteresis).
///
/// Why     If real-time threads use more than 95 % of a core in one second, the kernel stops all of them for the rest
///         of that second (sched_rt_runtime_us). All rooms would then stand still for 50 ms. Below that limit no thread
///         waits long: with five threads of 34 % each on two cores, the longest measured wait was 2 ms.
/// In      demands       for each thread: share of a core that it needs to keep its rate
///         cores         at least 1
/// In-out  has_priority  for each thread
void share_realtime(const std::vector<double>& demands, std::vector<bool>& has_priority, std::size_t cores);

}  // namespace tandem::server

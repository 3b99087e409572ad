// Decides which threads of a server have real-time priority, so that the kernel never has to throttle all of them.
#pragma once

#include <cstddef>
#include <vector>

namespace tandem::server {

/// The first user (io) always has priority. The others follow by ascending demand. No user may need 93 % of a core, and
/// all with priority together at most 93 % of `cores`. For users without priority the limit is 85 %, as hysteresis.
///
/// Why     if real-time threads use more than 95 % of a core in a second, the kernel stops all of them for the rest of
///         it (sched_rt_runtime_us). No room would step for 50 ms. Below that limit the kernel distributes them well:
///         five threads of 34 % each never waited longer than 2 ms on two cores.
/// In      demands       for each user: share of a core that it needs to keep its rate
///         cores         at least 1
/// In-out  has_priority  for each user
void share_realtime(const std::vector<double>& demands, std::vector<bool>& has_priority, std::size_t cores);

}  // namespace tandem::server

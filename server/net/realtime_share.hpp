// Which threads of a server have real-time priority, so that the kernel never has to stop them all.
#pragma once

#include <cstddef>
#include <vector>

namespace tandem::server {

/// The first user (io) has priority in any case. Then who needs least, as long as nobody needs 93 % of a core alone, nor all
/// with priority together 93 % of `cores`; 85 % for who has none yet, so that nobody comes and goes.
///
/// Why     where threads of real-time priority use more than 95 % of a core in a second the kernel stops all of them for the
///         rest of it (sched_rt_runtime_us): 50 ms of silence for rooms that did nothing wrong. Below that it deals them to
///         cores well by itself: five that need 34 % each never waited longer than 2 ms on two cores.
/// In      demands       of each user: share of a core that it needs to keep its rate
///         cores         at least 1
/// In-out  has_priority  of each user
void share_realtime(const std::vector<double>& demands, std::vector<bool>& has_priority, std::size_t cores);

}  // namespace tandem::server

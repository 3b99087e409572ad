// Converts the ticks of a live client to rows at whole milliseconds, which can be compared with the rows of a virtual
// trial.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One tick: the client's record, and the true state of the simulated hand, which the client itself cannot read.
struct LiveTick {
  client::TickRecord record;
  Pose hand_D;
  Twist hand_twist_D;
  Duration round_trip{0};  ///< newest round trip that the session has measured; added by the thread that reads the ring
};

/// Returns one row for each millisecond of the duration. Row k contains the newest tick earlier than k + 1 ms after
/// `start`, with the time of that tick. If the machine skipped a tick, the row repeats the previous tick, because the
/// device also holds its force. The row's phase and intended position are those at the time of the row.
///
/// In      ticks    in order of time; if it is empty, no rows are returned
/// Out     skipped  number of repeated rows
std::vector<TickSample> live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start,
                                  Duration duration, std::uint64_t& skipped);

}  // namespace tandem::lab

// Converts the ticks of a live client to one row per millisecond. A virtual trial has such rows too, so both can be
// compared row by row.
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
  /// newest round trip that the session has measured; set by the main thread when it reads the tick from the ring
  /// buffer
  Duration round_trip{0};
};

/// Returns one row for each millisecond of the duration. Row k contains:
/// * the newest tick earlier than k + 1 ms after `start`, with the time of this tick. If the machine skipped a tick,
///   the row repeats the previous one, whose force the device still displays;
/// * the phase and the intended position of the hand at the time of the row.
///
/// In      ticks    in order of time; if it is empty, no rows are returned
/// Out     skipped  number of repeated rows
std::vector<TickSample> live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start,
                                  Duration duration, std::uint64_t& skipped);

}  // namespace tandem::lab

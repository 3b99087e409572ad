// Ticks of a live client as rows at whole milliseconds, for comparison with the rows of a virtual trial.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One tick: the client's record and the true state of the hand, which only the haptic thread may read.
struct LiveTick {
  client::TickRecord record;
  Pose hand_D;
  Twist hand_twist_D;
  Duration round_trip{0};  ///< set by the reader, from the session's newest snapshot
};

/// One row per millisecond of the duration: row k is the newest tick before k + 1 ms after `start`, at its own time. If
/// the machine skipped a tick, the previous one is repeated, as for the hand; phase and intended position are those of
/// the row's time.
///
/// In      ticks  in order; empty: no rows
/// Out     skipped  number of repeated rows
std::vector<TickSample> live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start,
                                  Duration duration, std::uint64_t& skipped);

}  // namespace tandem::lab

// Ticks of a live client as rows at whole milliseconds, so that they can be held against those of a virtual trial.
#pragma once

#include <cstdint>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// One tick from the inside of the client and from the outside of the hand, which only the haptic thread may look at.
struct LiveTick {
  client::TickRecord record;
  Pose hand_D;
  Twist hand_twist_D;
  Duration round_trip{0};  ///< filled in by the reader, from the session's newest snapshot
};

/// One row a millisecond of the duration: row k is the newest tick before k + 1 ms after `start`, at its own time.
/// Where the machine skipped a tick, the one before is repeated, which is what the hand felt; phase and intended place
/// are those of the row's time.
///
/// In      ticks  in order; empty: no rows
/// Out     skipped  rows that repeat the one before
std::vector<TickSample> live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start,
                                  Duration duration, std::uint64_t& skipped);

}  // namespace tandem::lab

// How long a client's haptic tick takes in a session: hand, client, link and server as in a trial in virtual time, and
// a clock around nothing but the tick: not the simulated hand, nor the energy ledger that an experiment keeps.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/histogram.hpp"
#include "lab/experiment/experiment.hpp"

namespace tandem::lab {

/// One run of a session.
struct ClientBenchRun {
  Histogram tick;   ///< HapticCore::tick(), the clock's readings included
  Histogram fit;    ///< one fit of the wrenches' models off the path: six axes, the stage's settings
  Histogram clock;  ///< beside each tick: reading the clock
  Histogram work;   ///< beside each tick: a computation that is always the same, so that its tail is the machine's
  double force_max_n = 0;
  double local_share = 0;       ///< of the ticks that the local model had the hand
  double predicting_share = 0;  ///< of the ticks that had a predicted part
};

/// Runs the experiment's first user alone from joining to the end of its duration. Faster than real time: between two
/// ticks the server steps on the same core, so caches are as cold as they are for a client that shares its core.
///
/// Fails   std::runtime_error: the user does not get into the room, or has no local model where the stage wants one
ClientBenchRun bench_client(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

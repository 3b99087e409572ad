// A room at its own pace with simulated hands: how long its steps take, apart from how late the machine wakes it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/tick_faults.hpp"
#include "common/base/time.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::lab {

struct RoomBenchResult {
  Histogram step;              ///< of the room: inputs, physics, updates
  std::uint64_t overlong = 0;  ///< steps that took longer than the period
  Histogram lateness;          ///< of the wake-ups: the machine's, not the room's
  std::uint64_t missed = 0;    ///< periods skipped because a wake-up came more than a period late
  TickFaults faults = 0;
  std::uint32_t contacts_max = 0;  ///< points that pressed, all tools together
  double depth_max_m = 0;
  double force_max_n = 0;  ///< of the contacts of one tool
};

/// Runs the room in real time on this thread; the hands are moved between its steps and feel each step's wrench at
/// once.
///
/// In      hands  named hand paths, one a user; the n-th user gets the n-th tool
/// Fails   std::invalid_argument: more hands than tools, an unknown path
RoomBenchResult bench_room(const std::shared_ptr<const server::LoadedScene>& scene,
                           const std::vector<std::string>& hands, Duration duration);

}  // namespace tandem::lab

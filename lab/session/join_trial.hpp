// What it is like to join a room whose assets have to be fetched first, over a line that they share with state.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"

namespace tandem::lab {

/// Of the first user of one trial.
struct JoinFigures {
  std::string assets;  ///< as Experiment::assets
  std::optional<double> local_after_s =
      {};                   ///< from joining to the first touch by a local model; none: not in the trial
  double stream_bytes = 0;  ///< of control and assets, both ways
  double wait_p99_ms = 0;   ///< of state, until that touch, for the line …
  double wait_max_ms = 0;   ///< … beside which nothing else delays it but the link
  double states_per_s = 0;  ///< sent by the server meanwhile
};

/// One trial for each of asset_deliveries(): with "here" nothing is fetched, and the figures of state are of all the trial.
/// Fails   as run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

// What it is like to join a room whose assets have to be fetched first, over a line that they share with state.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"

namespace tandem::lab {

/// Of the first user of one trial.
struct JoinFigures {
  std::string assets;  ///< as Experiment::assets
  // From joining to the first touch by a local model, and by one of the whole assets; none: not in the trial.
  std::optional<double> local_after_s = {}, full_local_after_s = {};
  double stream_bytes = 0;  ///< of control and assets, both ways
  double wait_p99_ms = 0;   ///< of state, until the latter, for the line …
  double wait_max_ms = 0;   ///< … beside which nothing else delays it but the link
  double states_per_s = 0;  ///< sent by the server meanwhile
  // Between the two, beside the trial that has all assets from the start.
  std::size_t coarse_ticks = 0;   ///< in which that one's force was above 0.5 N
  double coarse_force_share = 0;  ///< RMS of the force's error over that of the force
  double coarse_mm = 0;           ///< RMS of how far the tool is from where it would be
  double going_over_n = 0;        ///< force as the model of the whole assets takes over
  double step_n = 0;              ///< largest of the force in a tick of the 0.4 s after
  double usual_step_n = 0;        ///< likewise of that trial
};

/// One trial for each of asset_deliveries(): with "here" nothing is fetched, and the figures of state are of all the trial.
/// Fails   as run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

// Measures joins of a room whose assets must first be fetched over a line that they share with the state.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"

namespace tandem::lab {

/// Figures of the first user of one trial.
struct JoinFigures {
  std::string assets;  ///< asset delivery, as in Experiment::assets
  // Time from joining to the first local model, and to the first one with all assets; none: not in the trial.
  std::optional<double> local_after_s = {}, full_local_after_s = {};
  double stream_bytes = 0;  ///< bytes of control and assets, both directions
  double wait_p99_ms = 0;   ///< 99th percentile of the wait of states for the line, until full_local_after_s
  double wait_max_ms = 0;   ///< maximum of the same wait; besides it states are delayed by the link only
  double states_per_s = 0;  ///< sent by the server in that time
  // Between the two times, compared with the trial that has all assets from the start.
  std::size_t coarse_ticks = 0;   ///< ticks in which that trial's force was above 0.5 N
  double coarse_force_share = 0;  ///< RMS force error relative to the RMS force
  double coarse_mm = 0;           ///< RMS distance between the tools of the two trials
  double going_over_n = 0;        ///< force when the model with all assets takes over
  double step_n = 0;              ///< largest change of the force in one tick of the following 0.4 s
  double usual_step_n = 0;        ///< the same in the other trial
};

/// Runs one trial for each of asset_deliveries(). With "here" nothing is fetched; its state figures cover the whole
/// trial.
/// Fails   see run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

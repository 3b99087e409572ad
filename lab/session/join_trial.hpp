// Measures how a user joins a room if the assets must first be fetched over a line that also carries the state.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"

namespace tandem::lab {

/// Results for the first user of one trial.
struct JoinFigures {
  std::string assets;  ///< how assets are delivered, as in Experiment::assets
  // Time from joining until there is a local model, and until there is one that has all assets. Empty: the trial ended
  // before that.
  std::optional<double> local_after_s = {}, full_local_after_s = {};
  double stream_bytes = 0;  ///< number of bytes of control and assets in both directions
  double wait_p99_ms = 0;   ///< 99th percentile of the time that states wait for the line, until full_local_after_s
  double wait_max_ms = 0;   ///< maximum of the same waiting time, which delays states in addition to the link's delay
  double states_per_s = 0;  ///< rate at which the server sends states until full_local_after_s
  // The following values describe the time from the first local model to the first one with all assets. They compare
  // the trial with the trial in which all assets are present from the start.
  std::size_t coarse_ticks = 0;   ///< compared ticks: force of the other trial at least 0.5 N
  double coarse_force_share = 0;  ///< RMS force error relative to the RMS force
  double coarse_mm = 0;           ///< RMS distance between the tool positions of the two trials
  double going_over_n = 0;        ///< force at the moment when the model with all assets takes over
  double step_n = 0;              ///< largest change of the force within one tick, during the 0.4 s after that moment
  double usual_step_n = 0;        ///< largest change of the force in the other trial in this time
};

/// Runs one trial for each of asset_deliveries(). With "here" nothing is fetched, and the values about states cover the
/// whole trial.
/// Fails   see run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

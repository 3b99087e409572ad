// Measures joining a room over a line that must transfer the assets and the state at the same time.
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
  std::string assets;  ///< delivery of the assets, as in Experiment::assets
  // Time from joining until the first local model exists, and until the first with all assets exists. Empty: the trial
  // ended earlier.
  std::optional<double> local_after_s = {}, full_local_after_s = {};
  double stream_bytes = 0;  ///< number of bytes of control and assets in both directions
  double wait_p99_ms = 0;   ///< 99th percentile of the time that states wait for the line, until full_local_after_s
  double wait_max_ms = 0;   ///< maximum of the same waiting time; it adds to the link's delay
  double states_per_s = 0;  ///< rate at which the server sends states until full_local_after_s
  // The following values compare this trial with the trial "here", whose user has all assets from the start. The first
  // three cover the time from the first local model (plus 0.4 s of blending) to the first with all assets.
  std::size_t coarse_ticks = 0;   ///< number of ticks at which the force of the trial "here" is at least 0.5 N
  double coarse_force_share = 0;  ///< RMS force error relative to the RMS force of the trial "here"
  double coarse_mm = 0;           ///< RMS distance between the tool positions of the two trials [mm]
  double going_over_n = 0;        ///< force when the model with all assets becomes active [N]
  double step_n = 0;              ///< largest force change within one tick [N], in the next 0.4 s
  double usual_step_n = 0;        ///< largest force change within one tick of the trial "here" [N], in the same 0.4 s
};

/// Runs one trial for each of asset_deliveries(). With "here" nothing is fetched, and the values about states cover the
/// whole trial.
/// Fails   see run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

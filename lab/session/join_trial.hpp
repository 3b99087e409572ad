// Measures how a user joins a room over a slow line. The line transfers the scene's assets and the room's states at the
// same time.
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
  // Time from joining until the client has a first local model (with coarse assets), and until it has a local model
  // with all assets. Empty: the trial ended before.
  std::optional<double> local_after_s = {}, full_local_after_s = {};
  double stream_bytes = 0;  ///< number of bytes of control and assets in both directions
  /// 99th percentile of the time for which a state waits until the line is free, over the states sent before
  /// full_local_after_s
  double wait_p99_ms = 0;
  double wait_max_ms = 0;   ///< maximum of the same waiting time; it adds to the link's delay
  double states_per_s = 0;  ///< rate at which the server sends states until full_local_after_s
  // The following values compare this trial with the trial "here", in which the user has all assets from the start. The
  // values coarse_… cover the time with coarse assets. It begins 0.4 s after the first local model, when the client has
  // blended to it, and ends when the model with all assets exists.
  std::size_t coarse_ticks = 0;  ///< number of ticks at which the force of the trial "here" is at least 0.5 N
  /// RMS of the force difference to the trial "here", divided by the RMS force of that trial
  double coarse_force_share = 0;
  double coarse_mm = 0;     ///< RMS distance between the tool positions of the two trials [mm]
  double going_over_n = 0;  ///< force at the time when the local model with all assets becomes active [N]
  double step_n = 0;        ///< largest force change within one tick [N], in the next 0.4 s
  double usual_step_n = 0;  ///< largest force change within one tick of the trial "here" [N], in the same 0.4 s
};

/// Runs one trial for each of asset_deliveries(). In the trial "here" no assets are fetched. Its values about states
/// cover the whole trial.
/// Fails   see run_virtual_session() and load_experiment_scene()
std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene);

}  // namespace tandem::lab

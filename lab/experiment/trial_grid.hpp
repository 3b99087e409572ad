// The trials of an experiment: blocks of axes, each block the product of its axes, times seeds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/experiment/quantities.hpp"

namespace tandem::lab {

/// One trial: an experiment with every quantity set.
struct Trial {
  Experiment experiment;
  ExperimentFile file;           ///< the parsed document: the file's with the settings applied
  boost::json::object settings;  ///< quantities that differ from the file, by name
};

/// Options of the command line for the trials of each file.
struct GridRequest {
  bool is_single = false;  ///< no grid: the file unchanged, and the axes below
  bool is_full = false;    ///< the product of all stages, predictors, passivity on and off, delays, jitter and loss
  std::optional<std::uint64_t> seeds;  ///< number of seeds, from the file's on
  std::vector<Axis> axes;              ///< replace the grid's axes of the same name
};

/// Expands the grid into trials in a fixed order, without duplicates.
///
/// The blocks are the file's `grid`, otherwise the built-in ones: the default stage with passivity controller on delays ×
/// jitter × loss; and every other stage without it on four delays of a perfect link, where further seeds give the same
/// result.
/// Fails   std::invalid_argument: a name or value that does not exist, more than kMaxTrials
std::vector<Trial> expand(const ExperimentFile& file, const GridRequest& request);
inline constexpr std::size_t kMaxTrials = 20000;

// Reference trials: the same hands with the same seed on a perfect link, without passivity controller, predictor,
// deadband or errors of the model. reference_of() uses the trial's reference stage, by default truth_stage().
Trial reference_of(const Trial& trial);
/// Reference trial on the stages of the trial's users.
Trial same_stage_of(const Trial& trial);

}  // namespace tandem::lab

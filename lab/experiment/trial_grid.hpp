// Which trials an experiment consists of: blocks of axes, each block the product of its axes, times seeds.
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
  ExperimentFile file;           ///< what was parsed: the file's document with the settings made
  boost::json::object settings;  ///< quantities in which it differs from the file, by name
};

/// What the command line says about the trials of each file.
struct GridRequest {
  bool is_single = false;  ///< no grid: the file as it stands, and the axes below
  bool is_full = false;    ///< the product of all stages, predictors, passivity on and off, delays, jitter and loss
  std::optional<std::uint64_t> seeds;  ///< so many, from the file's on
  std::vector<Axis> axes;              ///< in place of the grid's of the same name
};

/// The trials in a fixed order, each once.
///
/// The blocks are the file's `grid`; without one, the built-in: the default stage with passivity controller on delays ×
/// jitter × loss, and every other stage without it on four delays of a perfect link, where more than one seed would
/// give the same.
/// Fails   std::invalid_argument: a name or value that does not exist, more than kMaxTrials
std::vector<Trial> expand(const ExperimentFile& file, const GridRequest& request);
inline constexpr std::size_t kMaxTrials = 20000;

// What a trial is held against: the same hands with the same seed on a perfect link, without passivity controller,
// predictor, deadband or errors of the model.
/// On the trial's reference stage: the truth, where that is truth_stage().
Trial reference_of(const Trial& trial);
/// On the stages that its users have.
Trial same_stage_of(const Trial& trial);

}  // namespace tandem::lab

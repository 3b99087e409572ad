// Expands an experiment into trials. Terms: an axis is a quantity with a list of values; a block is a set of axes and
// contains all combinations of their values, each with every seed; the grid is the list of blocks.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/experiment/experiment.hpp"
#include "lab/experiment/quantities.hpp"

namespace tandem::lab {

/// One trial: an experiment in which every quantity has one value.
struct Trial {
  Experiment experiment;
  ExperimentFile file;           ///< document of the experiment file with the settings applied
  boost::json::object settings;  ///< quantities that differ from the experiment file, by name
};

/// Command-line options that select the trials of each file.
struct GridRequest {
  bool is_single = false;  ///< true: the grid is ignored; the file runs unchanged, except for `axes`
  bool is_full = false;    ///< true: all combinations of stages, predictors, passivity, delays, jitter and loss run
  std::optional<std::uint64_t> seeds;  ///< number of seeds; they count up from the seed in the file
  std::vector<Axis> axes;              ///< axes that replace those of the same name in the grid
};

/// Expands the grid into trials in a fixed order, without duplicates.
///
/// The blocks are those in the field `grid` of the file. Without this field there are two built-in blocks:
/// 1. The default stage with passivity controller, with all combinations of delay, jitter and loss.
/// 2. Every other stage without passivity controller, at four delays of a perfect link. It has a single seed, because a
///    perfect link is not random.
/// Fails   std::invalid_argument: a name or value does not exist, or there are more than kMaxTrials trials
std::vector<Trial> expand(const ExperimentFile& file, const GridRequest& request);
inline constexpr std::size_t kMaxTrials = 20000;

// Returns the reference trial: the same hands with the same seed on a perfect link, without passivity controller,
// predictor, deadband or model errors. Its stage is the trial's reference stage, by default truth_stage().
Trial reference_of(const Trial& trial);
/// Returns a reference trial like that of reference_of(), but each user keeps the user's own stage.
Trial same_stage_of(const Trial& trial);

}  // namespace tandem::lab

// Validation: accuracy of a classifier on data that was not used for its training.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "devices/eeg/classifier/model.hpp"

namespace tandem::eeg {

/// One fold of a cross-validation: training windows and test windows, as indices into Calibration::windows.
struct Fold {
  std::vector<std::size_t> training, test;
};

enum class SplitBy { kSessions, kBlocks, kWindows };

/// Returns the folds of a cross-validation.
/// * By sessions: each session is the test data of one fold, and `folds` has no effect.
/// * By blocks or by windows: these are distributed at random over `folds` parts. Each part is the test data of one
///   fold.
/// Fails   std::invalid_argument. By sessions: there are fewer than two sessions. By blocks: one of the two states has
///         fewer blocks than `folds`. By windows: there are fewer windows than `folds`
std::vector<Fold> split(const Calibration& calibration, SplitBy by, std::size_t folds, std::uint64_t seed);

/// Refuses folds in which windows of one block are in both the training and the test data. Windows of a block resemble
/// each other for reasons other than the state. Such a test would therefore measure how well the block is recognised.
/// Fails   std::invalid_argument: the message names the block and the remedy
void check_split(const Calibration& calibration, const std::vector<Fold>& folds);

/// Accuracy of a classifier on test data, with the accuracies that chance alone gives (permutation test).
struct Accuracy {
  std::size_t windows = 0, correct = 0;
  double share = 0;
  /// Quantiles (2.5 % and 97.5 %) of `share` by chance: over many random permutations of the labels of the tested
  /// blocks. Labels are permuted within each session.
  double chance_low = 0, chance_high = 0;
  double p_value = 1;  ///< fraction of the permutations whose accuracy is at least `share`

  bool is_above_chance() const { return share > chance_high; }
};

inline constexpr std::size_t kDefaultPermutations = 1000;

/// Trains and tests a classifier for each fold and returns the accuracy over all folds.
/// Fails   std::invalid_argument: see check_split() and train_machine()
Accuracy validate(const Calibration& calibration, const std::vector<Fold>& folds, double penalty,
                  std::size_t permutations, std::uint64_t seed);
/// Tests a trained model with sessions that were not used for its training.
/// Fails   std::invalid_argument: the model was trained with one of the recordings or blocks
Accuracy validate(const Model& model, const Calibration& test, std::size_t permutations, std::uint64_t seed);

}  // namespace tandem::eeg

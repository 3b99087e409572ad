// Accuracy on data that the classifier was not trained with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "devices/eeg/classifier/model.hpp"

namespace tandem::eeg {

/// Windows that train a classifier, and windows that test it: indices of Calibration::windows.
struct Fold {
  std::vector<std::size_t> training, test;
};

enum class SplitBy { kSessions, kBlocks, kWindows };

/// Makes the folds: each session is the test once; or the blocks, or the windows, are dealt out to `folds` parts.
/// Fails   std::invalid_argument: there are fewer sessions, or blocks of a state, than folds
std::vector<Fold> split(const Calibration& calibration, SplitBy by, std::size_t folds, std::uint64_t seed);

/// Refuses a split with windows of one block on both sides. Windows of a block resemble each other in either state, so
/// such a test measures how well the block is recognised.
/// Fails   std::invalid_argument: the message names the block and the remedy
void check_split(const Calibration& calibration, const std::vector<Fold>& folds);

/// Result of a validation, and the range that chance alone gives.
struct Accuracy {
  std::size_t windows = 0, correct = 0;
  double share = 0;
  /// 2.5 % and 97.5 % quantiles of the share when the labels of the tested blocks are permuted within their session
  double chance_low = 0, chance_high = 0;
  double p_value = 1;  ///< share of permutations that are at least as accurate

  bool is_above_chance() const { return share > chance_high; }
};

inline constexpr std::size_t kDefaultPermutations = 1000;

/// Trains and tests each fold.
/// Fails   std::invalid_argument, see check_split() and train_machine()
Accuracy validate(const Calibration& calibration, const std::vector<Fold>& folds, double penalty,
                  std::size_t permutations, std::uint64_t seed);
/// Tests a model with other sessions.
/// Fails   std::invalid_argument: the model was trained with one of the recordings or blocks
Accuracy validate(const Model& model, const Calibration& test, std::size_t permutations, std::uint64_t seed);

}  // namespace tandem::eeg

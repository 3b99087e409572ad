#include "devices/eeg/classifier/validation.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <stdexcept>

#include "common/base/random.hpp"

namespace tandem::eeg {
namespace {

constexpr double kBandTail = 0.025;

template <class T>
void shuffle(std::vector<T>& values, Random& random) {
  for (std::size_t i = values.size(); i > 1; --i) {
    const auto j = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
    const T kept = values[i - 1];
    values[i - 1] = values[j];
    values[j] = kept;
  }
}

/// Labelled state of a block or window: true if positive. Empty for a block without windows, which belongs to no fold.
using State = std::optional<bool>;

/// Assigns blocks or windows at random to folds. `states` has one element for each of them. Blocks or windows of the
/// same state are distributed evenly over the folds. Returns the fold of each element.
std::vector<std::size_t> dealt_out(const std::vector<State>& states, std::size_t folds, Random& random) {
  std::vector<std::size_t> order, fold(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i]) order.push_back(i);
  }
  shuffle(order, random);
  std::array<std::size_t, 2> next{};
  for (const std::size_t i : order) fold[i] = next[*states[i] ? 1 : 0]++ % folds;
  return fold;
}

void require_folds(std::size_t available, std::size_t folds, const std::string& what) {
  if (folds < 2) throw std::invalid_argument("--folds must be at least 2");
  if (available >= folds) return;
  throw std::invalid_argument("a validation by " + what + " needs at least " + std::to_string(folds) +
                              " of them, and there " + (available == 1 ? "is 1" : "are " + std::to_string(available)) +
                              "; name more sessions, or lower --folds");
}

std::vector<State> states_of_blocks(const Calibration& calibration) {
  const std::vector<bool> has_windows = blocks_with_windows(calibration);
  std::vector<State> states;
  for (std::size_t b = 0; b < has_windows.size(); ++b)
    states.push_back(has_windows[b] ? State(calibration.blocks[b].is_positive) : std::nullopt);
  return states;
}

/// Returns the fold of each window. For a split by sessions, sets `folds` to the number of sessions.
std::vector<std::size_t> fold_of_windows(const Calibration& calibration, SplitBy by, std::size_t& folds,
                                         std::uint64_t seed) {
  Random random(seed, 1);
  std::vector<State> states;
  if (by == SplitBy::kSessions) {
    require_folds(calibration.sessions.size(), 2, "sessions");
    folds = calibration.sessions.size();
  } else if (by == SplitBy::kBlocks) {
    states = states_of_blocks(calibration);
    const auto positive = std::ranges::count(states, State(true)), negative = std::ranges::count(states, State(false));
    require_folds(static_cast<std::size_t>(std::min(positive, negative)), folds, "blocks of each state");
  } else {
    for (const LabelledWindow& one : calibration.windows) states.push_back(one.is_positive);
    require_folds(states.size(), folds, "windows");
  }
  const std::vector<std::size_t> dealt = dealt_out(states, folds, random);
  std::vector<std::size_t> fold;
  for (std::size_t w = 0; w < calibration.windows.size(); ++w) {
    const std::size_t block = calibration.windows[w].block;
    if (by == SplitBy::kSessions)
      fold.push_back(calibration.blocks[block].session);
    else
      fold.push_back(dealt[by == SplitBy::kBlocks ? block : w]);
  }
  return fold;
}

/// Counts of a classifier's decisions for the windows of one block.
struct BlockResult {
  std::size_t session = 0;
  bool is_positive = false;
  std::size_t windows = 0, decided_positive = 0;

  std::size_t correct(bool is_labelled_positive) const {
    return is_labelled_positive ? decided_positive : windows - decided_positive;
  }
};

std::vector<BlockResult> empty_results(const Calibration& calibration) {
  std::vector<BlockResult> results;
  for (const CalibrationBlock& block : calibration.blocks) results.push_back({block.session, block.is_positive});
  return results;
}

void record(BlockResult& result, bool is_decided_positive) {
  ++result.windows;
  if (is_decided_positive) ++result.decided_positive;
}

/// Returns the labels of the blocks, randomly permuted within each session, for the permutation test.
std::vector<bool> permuted(const std::vector<BlockResult>& results, Random& random) {
  std::vector<bool> labels(results.size());
  std::set<std::size_t> sessions;
  for (const BlockResult& one : results) sessions.insert(one.session);
  for (const std::size_t session : sessions) {
    std::vector<char> states;
    for (const BlockResult& one : results) {
      if (one.session == session && one.windows > 0) states.push_back(one.is_positive ? 1 : 0);
    }
    shuffle(states, random);
    for (std::size_t b = 0; b < results.size(); ++b) {
      if (results[b].session != session || results[b].windows == 0) continue;
      labels[b] = states.back() != 0;
      states.pop_back();
    }
  }
  return labels;
}

std::size_t correct_with(const std::vector<BlockResult>& results, const std::vector<bool>& labels) {
  std::size_t correct = 0;
  for (std::size_t b = 0; b < results.size(); ++b) correct += results[b].correct(labels[b]);
  return correct;
}

Accuracy accuracy_of(const std::vector<BlockResult>& results, std::size_t permutations, std::uint64_t seed) {
  if (permutations < 100 || permutations > 1'000'000)
    throw std::invalid_argument("--permutations must be 100 to 1000000");
  Accuracy accuracy;
  std::vector<bool> labels;
  for (const BlockResult& one : results) {
    accuracy.windows += one.windows;
    labels.push_back(one.is_positive);
  }
  if (accuracy.windows == 0) throw std::invalid_argument("no window without artefacts is left for the test");
  accuracy.correct = correct_with(results, labels);
  const auto windows = static_cast<double>(accuracy.windows);
  accuracy.share = static_cast<double>(accuracy.correct) / windows;
  Random random(seed, 2);
  std::vector<std::size_t> by_chance;
  for (std::size_t i = 0; i < permutations; ++i) by_chance.push_back(correct_with(results, permuted(results, random)));
  std::ranges::sort(by_chance);
  const auto tail = static_cast<std::size_t>(kBandTail * static_cast<double>(permutations));
  accuracy.chance_low = static_cast<double>(by_chance[tail]) / windows;
  accuracy.chance_high = static_cast<double>(by_chance[permutations - 1 - tail]) / windows;
  const auto as_good = by_chance.end() - std::ranges::lower_bound(by_chance, accuracy.correct);
  accuracy.p_value = (1.0 + static_cast<double>(as_good)) / (1.0 + static_cast<double>(permutations));
  return accuracy;
}

}  // namespace

std::vector<Fold> split(const Calibration& calibration, SplitBy by, std::size_t folds, std::uint64_t seed) {
  const std::vector<std::size_t> fold_of = fold_of_windows(calibration, by, folds, seed);
  std::vector<Fold> result(folds);
  for (std::size_t w = 0; w < fold_of.size(); ++w) {
    for (std::size_t f = 0; f < folds; ++f) (fold_of[w] == f ? result[f].test : result[f].training).push_back(w);
  }
  std::erase_if(result, [](const Fold& fold) { return fold.test.empty(); });
  return result;
}

void check_split(const Calibration& calibration, const std::vector<Fold>& folds) {
  for (const Fold& fold : folds) {
    std::set<std::size_t> trained;
    for (const std::size_t w : fold.training) trained.insert(calibration.windows[w].block);
    for (const std::size_t w : fold.test) {
      const std::size_t block = calibration.windows[w].block;
      if (!trained.contains(block)) continue;
      throw std::invalid_argument(
          "windows of block " + std::to_string(block + 1) + " (" +
          calibration.sessions[calibration.blocks[block].session] +
          ") are in the training and in the test; windows of a block resemble each other whatever the state is, so the "
          "accuracy would be too high; split by sessions or by blocks");
    }
  }
}

Accuracy validate(const Calibration& calibration, const std::vector<Fold>& folds, double penalty,
                  std::size_t permutations, std::uint64_t seed) {
  check_split(calibration, folds);
  std::vector<BlockResult> results = empty_results(calibration);
  for (const Fold& fold : folds) {
    const Model machine = train_machine(calibration, fold.training, penalty);
    for (const std::size_t w : fold.test) {
      const LabelledWindow& window = calibration.windows[w];
      record(results[window.block], machine.decision(window.features) > 0);
    }
  }
  return accuracy_of(results, permutations, seed);
}

Accuracy validate(const Model& model, const Calibration& test, std::size_t permutations, std::uint64_t seed) {
  for (std::size_t i = 0; i < test.sessions.size(); ++i) {
    if (std::ranges::find(model.trained_sessions, test.session_fingerprints[i]) == model.trained_sessions.end())
      continue;
    throw std::invalid_argument(test.sessions[i] +
                                ": the model was trained with this recording; test it with another session");
  }
  const std::set<std::string> trained(model.trained_blocks.begin(), model.trained_blocks.end());
  std::vector<BlockResult> results = empty_results(test);
  for (const LabelledWindow& window : test.windows) {
    const CalibrationBlock& block = test.blocks[window.block];
    if (trained.contains(block.fingerprint))
      throw std::invalid_argument(test.sessions[block.session] + ": the model was trained with block " +
                                  std::to_string(window.block + 1) +
                                  " of this recording; test it with a session that it has not seen");
    record(results[window.block], model.valence(window.features).value > 0);
  }
  return accuracy_of(results, permutations, seed);
}

}  // namespace tandem::eeg

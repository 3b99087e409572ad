// Classifier for one person: a linear support vector machine on standardised features.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "devices/eeg/classifier/calibration.hpp"

namespace tandem::eeg {

/// Output of the classifier for one window: how positive the emotional state is (valence), and the confidence in its
/// sign.
struct Valence {
  double value = 0;         ///< 2 p - 1 with p = p(positive): from -1 (negative) to 1 (positive)
  double confidence = 0.5;  ///< probability of the more probable state, 0.5 to 1
};

/// A trained classifier, with the data format and the settings of its training. Later data must have the same ones.
///
/// Model    f = Σ w (x − μ) s + b over the features x, with mean μ, scale s and weight w of each;
///          p(positive) = 1/(1 + exp(−(slope f + offset)))
/// Source   Cortes, Vapnik, "Support-vector networks", Machine Learning 20, 1995; for the probability: Platt,
///          "Probabilistic outputs for support vector machines", 1999, here fitted to held-out blocks
struct Model {
  StreamFormat format;  ///< channels and rate
  WindowSettings settings;
  Labels labels;
  std::vector<double> mean, scale, weights;  ///< one value for each feature; each channel has kFeatureCount features
  double bias = 0;
  double slope = 1, offset = 0;
  /// Hashes of the training data, so that a test with the same data is refused. Both the blocks and the whole
  /// recordings are listed, because a copy of a recording may be cut into blocks that begin and end at different times.
  std::vector<std::string> trained_blocks, trained_sessions;

  double decision(std::span<const double> features) const;
  Valence valence(std::span<const double> features) const;
};

/// Penalty C of the support vector machine. A small value is suitable for many correlated features.
inline constexpr double kDefaultPenalty = 0.01;

/// Trains the machine only. The probability is not fitted: slope 1, offset 0.
///
/// In      windows  training windows, as indices into calibration.windows
/// Fails   std::invalid_argument: one of the states has no window
Model train_machine(const Calibration& calibration, std::span<const std::size_t> windows, double penalty);
/// Trains with all windows, and fits the probability by cross-validation over blocks.
/// Fails   std::invalid_argument: fewer than two blocks of a state have windows; the message names the remedy
Model train(const Calibration& calibration, double penalty);

/// Writes the model as JSON.
/// Fails   std::invalid_argument: the file cannot be written
void save_model(const Model& model, const std::filesystem::path& file);
/// Fails   std::invalid_argument: the message names the file, the field, the value and the remedy
Model load_model(const std::filesystem::path& file);
/// Compares the channels of a source, their order and their rate with those of the model.
/// Fails   std::invalid_argument: they differ; the message names both values
void check_source(const Model& model, const StreamFormat& format, const std::string& origin);

}  // namespace tandem::eeg

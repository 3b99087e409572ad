// Classifier of one person: linear, on standardised features.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "devices/eeg/classifier/calibration.hpp"

namespace tandem::eeg {

/// The signal and how sure the classifier is of its sign.
struct Valence {
  double value = 0;         ///< -1 negative … 1 positive: 2 p - 1
  double confidence = 0.5;  ///< probability of the more probable state, 0.5 … 1
};

/// A trained classifier, with everything that its use must have in common with its training.
///
/// Model    f = w · (x − μ)/s + b;  p(positive) = 1/(1 + exp(−(slope f + offset)))
/// Source   Cortes, Vapnik, "Support-vector networks", Machine Learning 20, 1995; the probability: Platt, "Probabilistic
///          outputs for support vector machines", 1999, here fitted to blocks that the machine was not trained with
struct Model {
  StreamFormat format;  ///< channels and rate
  WindowSettings settings;
  Labels labels;
  std::vector<double> mean, scale, weights;  ///< each feature has one; kFeatureCount for each channel
  double bias = 0;
  double slope = 1, offset = 0;
  /// Fingerprints of the training data, so that a test with the same data is refused: of the blocks, and of whole
  /// recordings, because the same samples can be cut into blocks with other borders.
  std::vector<std::string> trained_blocks, trained_sessions;

  double decision(std::span<const double> features) const;
  Valence valence(std::span<const double> features) const;
};

/// Penalty of the support vector machine. Small values suit features that are many and correlated.
inline constexpr double kDefaultPenalty = 0.01;

/// Trains without a probability (slope 1, offset 0).
///
/// In      windows  indices of calibration.windows
/// Fails   std::invalid_argument: one of the states has no window
Model train_machine(const Calibration& calibration, std::span<const std::size_t> windows, double penalty);
/// Trains with all windows, and fits the probability to blocks left out in turn.
/// Fails   std::invalid_argument: fewer than two blocks of a state have windows; the message names the remedy
Model train(const Calibration& calibration, double penalty);

/// Writes the model as JSON.
/// Fails   std::invalid_argument: the file cannot be written
void save_model(const Model& model, const std::filesystem::path& file);
/// Fails   std::invalid_argument: the message names the file, the field, the value and the remedy
Model load_model(const std::filesystem::path& file);
/// Compares channels, their order and rate of a source with the model.
/// Fails   std::invalid_argument: they differ; the message names both
void check_source(const Model& model, const StreamFormat& format, const std::string& origin);

}  // namespace tandem::eeg

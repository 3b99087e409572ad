// Classifier for one person: a linear support vector machine on standardised features.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "devices/eeg/classifier/calibration.hpp"

namespace tandem::eeg {

/// Output of the classifier for one window: the valence (how positive the emotional state is), and the confidence in
/// the sign of the valence.
struct Valence {
  double value = 0;         ///< 2 p - 1 with p = p(positive): from -1 (negative) to 1 (positive)
  double confidence = 0.5;  ///< probability of the more probable state, 0.5 to 1
};

/// A trained classifier with the data format and the settings that were used for its training. Data to classify must
/// have the same format and settings.
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
  /// Hashes of the training data, from which a test with the same data is detected and refused. The hashes of whole
  /// recordings detect a copy whose blocks have different limits; the hashes of blocks detect a copy of a part.
  std::vector<std::string> trained_blocks, trained_sessions;

  double decision(std::span<const double> features) const;
  Valence valence(std::span<const double> features) const;
};

/// Penalty C of the support vector machine. A small value is suitable for many correlated features.
inline constexpr double kDefaultPenalty = 0.01;

/// Trains the support vector machine only. The sigmoid that gives probabilities is not fitted (slope 1, offset 0).
///
/// In      windows  training windows, as indices into calibration.windows
/// Fails   std::invalid_argument: one of the states has no window
Model train_machine(const Calibration& calibration, std::span<const std::size_t> windows, double penalty);
/// Trains with all windows. Then fits the sigmoid for p(positive) to the results of a cross-validation over blocks.
/// Fails   std::invalid_argument: fewer than two blocks of a state have windows; the message names the remedy
Model train(const Calibration& calibration, double penalty);

/// Writes the model as JSON.
/// Fails   std::invalid_argument: the file cannot be written
void save_model(const Model& model, const std::filesystem::path& file);
/// Fails   std::invalid_argument: the message names the file, the field, the value and the remedy
Model load_model(const std::filesystem::path& file);
/// Checks that a source has the same channels in the same order, and the same rate, as the training data of the model.
/// Fails   std::invalid_argument: they differ; the message names both values
void check_source(const Model& model, const StreamFormat& format, const std::string& origin);

}  // namespace tandem::eeg

#include "devices/eeg/classifier/model.hpp"

#include <libsvm/svm.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "devices/eeg/classifier/sigmoid.hpp"

namespace tandem::eeg {
namespace {

constexpr std::size_t kInnerFolds = 5;
constexpr int kPositive = 1, kNegative = -1;

/// The windows in libsvm's format: for each window a list of (index, value) pairs, terminated by the index -1.
class SvmProblem {
 public:
  SvmProblem(const Model& model, const Calibration& calibration, std::span<const std::size_t> windows)
      : width_(model.mean.size() + 1), nodes_(windows.size() * width_) {
    for (std::size_t row = 0; row < windows.size(); ++row) {
      const LabelledWindow& window = calibration.windows[windows[row]];
      svm_node* const first = &nodes_[row * width_];
      for (std::size_t i = 0; i + 1 < width_; ++i)
        first[i] = {static_cast<int>(i) + 1, (window.features[i] - model.mean[i]) * model.scale[i]};
      first[width_ - 1] = {-1, 0};
      rows_.push_back(first);
      states_.push_back(window.is_positive ? kPositive : kNegative);
    }
  }
  svm_problem view() { return {static_cast<int>(rows_.size()), states_.data(), rows_.data()}; }

 private:
  std::size_t width_;
  std::vector<svm_node> nodes_;
  std::vector<svm_node*> rows_;
  std::vector<double> states_;
};

/// Computes the mean and the scale (1/σ) of each feature. A constant feature gets the scale 0 and thus no influence.
void standardise(Model& model, const Calibration& calibration, std::span<const std::size_t> windows) {
  const std::size_t width = calibration.windows[windows.front()].features.size();
  const auto count = static_cast<double>(windows.size());
  model.mean.assign(width, 0);
  model.scale.assign(width, 0);
  for (const std::size_t w : windows) {
    for (std::size_t i = 0; i < width; ++i) model.mean[i] += calibration.windows[w].features[i] / count;
  }
  for (std::size_t i = 0; i < width; ++i) {
    double squares = 0;
    for (const std::size_t w : windows) squares += std::pow(calibration.windows[w].features[i] - model.mean[i], 2);
    const double deviation = std::sqrt(squares / count);
    model.scale[i] = deviation > 1e-12 * std::abs(model.mean[i]) && deviation > 0 ? 1 / deviation : 0;
  }
}

svm_parameter parameters_of(double penalty, std::array<int, 2>& states, std::array<double, 2>& weights) {
  svm_parameter parameter{};
  parameter.svm_type = C_SVC;
  parameter.kernel_type = LINEAR;
  parameter.C = penalty;
  parameter.cache_size = 100;
  parameter.eps = 1e-3;
  parameter.shrinking = 1;
  parameter.nr_weight = 2;
  parameter.weight_label = states.data();
  parameter.weight = weights.data();
  return parameter;
}

/// Computes the weight vector of a linear support vector machine as the weighted sum of its support vectors.
void take_weights(Model& model, const svm_model& machine) {
  model.weights.assign(model.mean.size(), 0);
  for (int i = 0; i < machine.l; ++i) {
    for (const svm_node* node = machine.SV[i]; node->index != -1; ++node)
      model.weights[static_cast<std::size_t>(node->index - 1)] += machine.sv_coef[0][i] * node->value;
  }
  // In libsvm, a positive decision value stands for the label of the first training sample. That label may be either
  // state, so the sign is adapted.
  const double sign = machine.label[0] == kPositive ? 1 : -1;
  for (double& weight : model.weights) weight *= sign;
  model.bias = -sign * machine.rho[0];
}

std::size_t blocks_with(const Calibration& calibration, bool is_positive) {
  const std::vector<bool> has_windows = blocks_with_windows(calibration);
  std::size_t count = 0;
  for (std::size_t b = 0; b < has_windows.size(); ++b)
    count += has_windows[b] && calibration.blocks[b].is_positive == is_positive ? 1U : 0U;
  return count;
}

/// Cross-validation. Returns two values for each window: its decision value, and whether it is positive. The decision
/// value is that of a machine that was trained without the windows of the same fold.
std::vector<std::pair<double, bool>> held_out_decisions(const Calibration& calibration, double penalty) {
  std::vector<std::size_t> fold_of(calibration.blocks.size());
  const std::vector<bool> has_windows = blocks_with_windows(calibration);
  std::array<std::size_t, 2> next{};  // number of blocks of each state that have a fold (round robin)
  for (std::size_t b = 0; b < fold_of.size(); ++b) {
    if (has_windows[b]) fold_of[b] = next[calibration.blocks[b].is_positive ? 1 : 0]++ % kInnerFolds;
  }
  std::vector<std::pair<double, bool>> decisions;
  for (std::size_t fold = 0; fold < kInnerFolds; ++fold) {
    std::vector<std::size_t> training;
    for (std::size_t w = 0; w < calibration.windows.size(); ++w) {
      if (fold_of[calibration.windows[w].block] != fold) training.push_back(w);
    }
    if (training.size() == calibration.windows.size()) continue;
    const Model machine = train_machine(calibration, training, penalty);
    for (const LabelledWindow& one : calibration.windows) {
      if (fold_of[one.block] == fold) decisions.emplace_back(machine.decision(one.features), one.is_positive);
    }
  }
  return decisions;
}

}  // namespace

double Model::decision(std::span<const double> features) const {
  double sum = bias;
  for (std::size_t i = 0; i < weights.size(); ++i) sum += weights[i] * (features[i] - mean[i]) * scale[i];
  return sum;
}

Valence Model::valence(std::span<const double> features) const {
  const double p = 1 / (1 + std::exp(-(slope * decision(features) + offset)));
  return {2 * p - 1, std::max(p, 1 - p)};
}

Model train_machine(const Calibration& calibration, std::span<const std::size_t> windows, double penalty) {
  if (!(penalty > 0 && penalty <= 1e6)) throw std::invalid_argument("--penalty must be above 0 and at most 1e6");
  const auto positive = static_cast<double>(
      std::ranges::count_if(windows, [&](std::size_t w) { return calibration.windows[w].is_positive; }));
  const double negative = static_cast<double>(windows.size()) - positive;
  if (positive == 0 || negative == 0)
    throw std::invalid_argument("no window without artefacts is labelled '" +
                                (positive == 0 ? calibration.labels.positive : calibration.labels.negative) +
                                "' in the training data; record more blocks, or improve the contact");
  Model model;
  model.format = {calibration.format.channels, calibration.format.rate_hz, {}};
  model.settings = calibration.settings;
  model.labels = calibration.labels;
  standardise(model, calibration, windows);
  // Class weights balance the two states when they have different numbers of windows.
  std::array<int, 2> states{kPositive, kNegative};
  std::array<double, 2> weights{(positive + negative) / (2 * positive), (positive + negative) / (2 * negative)};
  svm_set_print_string_function([](const char*) {});
  SvmProblem problem(model, calibration, windows);
  const svm_problem view = problem.view();
  const svm_parameter parameter = parameters_of(penalty, states, weights);
  const std::unique_ptr<svm_model, void (*)(svm_model*)> machine(
      svm_train(&view, &parameter), [](svm_model* one) { svm_free_and_destroy_model(&one); });
  take_weights(model, *machine);
  return model;
}

Model train(const Calibration& calibration, double penalty) {
  for (const bool is_positive : {false, true}) {
    const std::size_t count = blocks_with(calibration, is_positive);
    if (count < 2)
      throw std::invalid_argument("blocks labelled '" +
                                  (is_positive ? calibration.labels.positive : calibration.labels.negative) +
                                  "' with windows without artefacts: " + std::to_string(count) +
                                  "; a calibration needs at least 2 of each state, 10 are better");
  }
  std::vector<std::size_t> all(calibration.windows.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  Model model = train_machine(calibration, all, penalty);
  const Sigmoid sigmoid = fit_sigmoid(held_out_decisions(calibration, penalty));
  model.slope = sigmoid.slope;
  model.offset = sigmoid.offset;
  for (const CalibrationBlock& block : calibration.blocks) model.trained_blocks.push_back(block.fingerprint);
  model.trained_sessions = calibration.session_fingerprints;
  return model;
}

void check_source(const Model& model, const StreamFormat& format, const std::string& origin) {
  const auto list = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text;
  };
  if (format.channels != model.format.channels)
    throw std::invalid_argument(origin + ": channels are " + list(format.channels) +
                                ", and the model was trained with " + list(model.format.channels) +
                                "; use the same headset, or train again");
  if (format.rate_hz != model.format.rate_hz)
    throw std::invalid_argument(origin + ": rate is " + std::to_string(format.rate_hz) +
                                " Hz, and the model was trained with " + std::to_string(model.format.rate_hz) +
                                " Hz; use the same headset, or train again");
}

}  // namespace tandem::eeg

#include "lab/results/random_claims.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lab/results/study_results.hpp"

namespace tandem::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Value {
  double value = kNone;
  std::string trial;
};

std::string name_of_trial(const RandomOutcome& outcome) {
  return text_in(outcome.row, "experiment") + ", trial " + std::to_string(outcome.number);
}

/// Returns the finite values of a metric in ascending order.
template <class Counts>
std::vector<Value> values_of(std::span<const RandomOutcome> outcomes, std::string_view metric, const Counts& counts) {
  std::vector<Value> values;
  for (const RandomOutcome& outcome : outcomes) {
    const double value = number_in(outcome.row, metric);
    if (!was_silent(outcome.row) && std::isfinite(value) && counts(outcome))
      values.push_back({value, name_of_trial(outcome)});
  }
  std::ranges::sort(values, {}, &Value::value);
  return values;
}

bool is_all(const RandomOutcome&) {
  return true;
}

/// Returns the claim that a quantile of the values is at most `bound`. The quantile is the smallest value v for which
/// at least the fraction `share` of all values is at most v.
RandomClaim quantile(const std::string& text, const std::vector<Value>& values, double share, double bound) {
  if (values.empty()) return {text, kNone, bound, 0, ""};
  const auto index = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  const Value& value = values.at(std::clamp<std::size_t>(index, 1, values.size()) - 1);
  return {text, value.value, bound, values.size(), value.trial};
}

RandomClaim drops(std::span<const RandomOutcome> outcomes) {
  RandomClaim claim{"bodies dropped that are held at zero delay, without a silence above 110 ms", 0, 0, 0, ""};
  for (const RandomOutcome& outcome : outcomes) {
    if (!outcome.truth_succeeds || was_silent(outcome.row)) continue;
    claim.trials += 1;
    if (text_in(outcome.row, "outcome") == "completed") continue;
    claim.value += 1;
    claim.worst += (claim.worst.empty() ? "" : "; ") + name_of_trial(outcome);
  }
  return claim;
}

}  // namespace

std::vector<RandomClaim> random_claims(std::span<const RandomOutcome> outcomes) {
  const auto of = [](const char* experiment) {
    return [experiment](const RandomOutcome& outcome) { return text_in(outcome.row, "experiment") == experiment; };
  };
  const auto is_usual = [](const RandomOutcome& outcome) {
    const std::string name = text_in(outcome.row, "experiment");
    return name != "soft" && name != "three_hands" && name != "four_hands";
  };
  const char* const error = "path_error_of_peak";
  std::vector<Value> energies_mj = values_of(outcomes, "energy_created_in_100_ms_j", is_all);
  for (Value& energy : energies_mj) energy.value *= 1e3;
  return {
      drops(outcomes),
      quantile("largest force step [N/ms]", values_of(outcomes, "force_step_max_n_per_ms", is_all), 1, 0.5),
      quantile("energy created within 100 ms, 99 % of trials [mJ]", energies_mj, 0.99, 20),
      quantile("energy created within 100 ms, all trials [mJ]", energies_mj, 1, 60),
      quantile("median path error of the peak, one and two hands", values_of(outcomes, error, is_usual), 0.5, 0.04),
      quantile("median path error of the peak, soft bodies", values_of(outcomes, error, of("soft")), 0.5, 0.08),
      quantile("median path error of the peak, three hands", values_of(outcomes, error, of("three_hands")), 0.5, 0.08),
      quantile("median path error of the peak, four hands", values_of(outcomes, error, of("four_hands")), 0.5, 0.18)};
}

}  // namespace tandem::lab

// Runs a shipped experiment once under given conditions, and compares it with the same hands at zero delay.
#pragma once

#include <filesystem>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lab/experiment/experiment_library.hpp"
#include "lab/experiment/trial_grid.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/metrics/outcome.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/results/study_results.hpp"
#include "lab/session/virtual_session.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {

using Quantities = std::vector<std::string>;  ///< settings in the format of --set, e.g. "link.rtt_ms=100"

/// Conditions for claims about the default stage: delay, jitter of 10 ms, and 5 % loss in bursts of 20 ms.
inline Quantities disturbed(double round_trip_ms, const Quantities& more = {}) {
  Quantities all{"link.rtt_ms=" + std::to_string(round_trip_ms), "link.jitter_ms=10", "link.loss=0.05"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}
/// Conditions for claims about other stages: delay without jitter and loss, no passivity controller.
inline Quantities bare(const std::string& stage, double round_trip_ms) {
  return {"stage=" + stage, "passivity=false", "link.rtt_ms=" + std::to_string(round_trip_ms)};
}

inline Trial shipped_trial(const std::string& name, const Quantities& quantities) {
  GridRequest request;
  request.is_single = true;
  for (const std::string& text : quantities) request.axes.push_back(parse_axis(text));
  std::vector<Trial> trials =
      expand(read_experiment_file(test::source_path("lab/experiments") / (name + ".json")), request);
  if (trials.size() != 1) throw std::invalid_argument(name + ": one trial was meant");
  return std::move(trials.front());
}

/// A trial and its reference, which has the same hands at zero delay. The constructor runs both.
class Shown {
 public:
  Shown(const std::string& name, const Quantities& quantities) : trial_(shipped_trial(name, quantities)) {
    const auto scene = load_experiment_scene(trial_.experiment);
    reference_ = run_virtual_session(reference_of(trial_).experiment, scene);
    trace_ = run_virtual_session(trial_.experiment, scene);
  }

  double operator[](std::string_view metric) const { return trial_metric(view(), metric); }
  std::string outcome() const { return outcome_of(view()); }
  /// Returns whether a silence of the link was so long that the force had to decay. Separate bounds apply to such a
  /// trial.
  bool was_silent() const { return (*this)["silence_max_ms"] > kLongSilence_ms; }
  const SessionTrace& trace() const { return trace_; }
  const SessionTrace& reference() const { return reference_; }

 private:
  TrialView view() const { return {trial_.experiment, trace_, &reference_}; }

  Trial trial_;
  SessionTrace reference_;
  SessionTrace trace_;
};

/// Parameter of claims that hold for several cases: an experiment at a round-trip delay.
struct At {
  const char* experiment;
  double round_trip_ms;

  Quantities quantities() const { return disturbed(round_trip_ms); }
};
inline std::ostream& operator<<(std::ostream& out, const At& at) {
  return out << at.experiment << " at " << at.round_trip_ms << " ms";
}
template <class Info>
std::string name_of_case(const Info& info) {
  return std::string(info.param.experiment) + "_" + std::to_string(static_cast<int>(info.param.round_trip_ms)) + "ms";
}

}  // namespace tandem::lab

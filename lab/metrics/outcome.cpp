#include "lab/metrics/outcome.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "lab/metrics/metrics.hpp"
#include "lab/metrics/touch_errors.hpp"

namespace tandem::lab {
namespace {

double height_m(const SessionTrace& trace, const BodiesSample& sample, std::size_t body) {
  return sample.X_WB[body].p.z() - trace.bodies.front().X_WB[body].p.z();
}

/// Returns the index of the rule's body, or nullopt if the trace has no such body or no samples.
std::optional<std::size_t> body_of(const OutcomeRule& rule, const SessionTrace& trace) {
  const auto name = std::find(trace.body_names.begin(), trace.body_names.end(), rule.body);
  if (name == trace.body_names.end() || trace.bodies.empty()) return std::nullopt;
  return static_cast<std::size_t>(name - trace.body_names.begin());
}

std::string place_outcome(const OutcomeRule& rule, const SessionTrace& trace) {
  const auto found = body_of(rule, trace);
  if (!found) return "missed";
  const double off_m = (trace.bodies.back().X_WB[*found].p - *rule.ends_at_W).norm();
  return off_m <= rule.ends_within_m ? "completed" : "missed";
}

std::string lift_outcome(const OutcomeRule& rule, const SessionTrace& trace) {
  const auto found = body_of(rule, trace);
  if (!found) return "never-lifted";
  const std::size_t body = *found;
  const devices::HandPath& hand = trace.users.front().user.hand;
  const int phase = phase_called(trace.users.front(), rule.during);
  bool was_lifted = false;
  bool was_low = false;
  for (const BodiesSample& sample : trace.bodies) {
    const bool is_high = height_m(trace, sample, body) >= rule.lifted_above_m;
    was_lifted = was_lifted || is_high;
    was_low = was_low || (hand.phase_at(sample.time) == phase && !is_high);
  }
  if (!was_lifted) return "never-lifted";
  return was_low ? "dropped" : "completed";
}

/// Returns the outcome by the experiment's rule, or "completed" if there is no rule.
std::string rule_outcome(const Experiment& experiment, const SessionTrace& trace) {
  if (!experiment.outcome) return "completed";
  const OutcomeRule& rule = *experiment.outcome;
  return rule.ends_at_W ? place_outcome(rule, trace) : lift_outcome(rule, trace);
}

bool is_weak(const TrialView& view) {
  for (std::size_t i = 0; i < view.trace.users.size(); ++i) {
    if (contact_force_ratio(view_of_user(view, i)) < kMinForceRatio) return true;
  }
  return false;
}

}  // namespace

std::string outcome_of(const TrialView& view) {
  for (const UserTrace& user : view.trace.users) {
    if (!user.stayed_connected) return "lost";
  }
  const std::string outcome = rule_outcome(view.experiment, view.trace);
  return outcome == "completed" && is_weak(view) ? "weak" : outcome;
}

}  // namespace tandem::lab

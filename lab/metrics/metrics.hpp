// Metrics of a single user's trace. Each metric is one function, listed with its unit in the table of metrics.cpp. A
// metric in that table also appears in trial.json and in the trial's report. Metrics that compare stages are in
// trial_metrics.hpp.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Value of a metric that is not defined for a trace.
inline constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// Returns the magnitude of the force that the device displayed [N].
inline double displayed_force_n(const TickSample& tick) {
  return tick.displayed_D.f.norm();
}

/// Duration of settling at the start of a hold phase. A hand that still moves after this time is in a limit cycle.
inline constexpr Duration kSettling{from_seconds(1.0)};
/// Returns the ticks in which the hand rests at a waypoint, without the first kSettling of each hold phase.
std::vector<const TickSample*> settled_hold_ticks(const UserTrace& user);

struct UserMetric {
  std::string_view name;                 ///< key in trial.json, including the unit
  std::string_view meaning;              ///< explanation in one line, for users
  double (*value_of)(const UserTrace&);  ///< NaN: the metric is not defined for this trace
};
const std::vector<UserMetric>& user_metrics();
/// Returns the value of the metric with this name. Fails: std::invalid_argument for an unknown name.
double user_metric(const UserTrace& user, std::string_view name);

/// Returns the distance of a body from its start position [m], for each sample in SessionTrace::bodies.
std::vector<double> body_travel_m(const SessionTrace& trace, std::size_t body);

/// Returns the index of the phase with this name, as in TickSample::phase, or a value below −1 if the path has no such
/// phase.
int phase_called(const UserTrace& user, std::string_view name);

}  // namespace tandem::lab

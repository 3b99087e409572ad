// Metrics of one user's trace alone. Each is one function, named with its unit in the table of metrics.cpp; an entry
// there also appears in trial.json and the trial's report. trial_metrics.hpp has the metrics that compare stages.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Value of a metric that does not apply.
inline constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// Magnitude of the force that the device displayed.
inline double displayed_force_n(const TickSample& tick) {
  return tick.displayed_D.f.norm();
}

/// Ticks in which the hand rests at a hold way point, without the first second. The hand still settles when the phase
/// begins. Motion that remains after a second is a limit cycle.
inline constexpr Duration kSettling{from_seconds(1.0)};
std::vector<const TickSample*> settled_hold_ticks(const UserTrace& user);

struct UserMetric {
  std::string_view name;                 ///< key in trial.json, including the unit
  std::string_view meaning;              ///< one line, for the user
  double (*value_of)(const UserTrace&);  ///< NaN: does not apply
};
const std::vector<UserMetric>& user_metrics();
/// Value of the metric with this name. Fails: std::invalid_argument for an unknown name.
double user_metric(const UserTrace& user, std::string_view name);

/// Distance of a body from its start at each sample of the bodies.
std::vector<double> body_travel_m(const SessionTrace& trace, std::size_t body);

/// Index of the hand path's phase with this name, as in TickSample::phase; less than −1 if there is none.
int phase_called(const UserTrace& user, std::string_view name);

}  // namespace tandem::lab

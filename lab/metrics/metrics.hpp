// What one user's trace says by itself. Each is one function, named with its unit in the table of metrics.cpp; adding
// one there puts it into trial.json and the trial's report. What stages are compared by is in trial_metrics.hpp.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Of a metric that does not apply.
inline constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// What the device was given.
inline double displayed_force_n(const TickSample& tick) {
  return tick.displayed_D.f.norm();
}

/// A stretch of ticks in which the hand rests at a hold way point, without the first second.
///
/// A hand that holds is still settling when the phase begins; what is left after a second is either calm or a
/// limit cycle.
inline constexpr Duration kSettling{from_seconds(1.0)};
std::vector<const TickSample*> settled_hold_ticks(const UserTrace& user);

struct UserMetric {
  std::string_view name;           ///< as in trial.json, unit included
  std::string_view meaning;        ///< one line, for people
  double (*of)(const UserTrace&);  ///< NaN: does not apply
};
const std::vector<UserMetric>& user_metrics();
/// The value of the metric called `name`. Fails: std::invalid_argument for an unknown name.
double user_metric(const UserTrace& user, std::string_view name);

/// How far a body is from where it started, at each sample of the bodies.
std::vector<double> body_travel_m(const SessionTrace& trace, std::size_t body);

/// Index of the hand path's phase of that name, as TickSample::phase has it; less than −1: it has none.
int phase_called(const UserTrace& user, std::string_view name);

}  // namespace tandem::lab

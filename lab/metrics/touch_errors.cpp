#include "lab/metrics/touch_errors.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "lab/metrics/high_pass.hpp"
#include "lab/metrics/metrics.hpp"

namespace tandem::lab {
namespace {

/// a force above this value is a ghost force if the reference displays less than kNoForce_n at this time
constexpr double kGhostForce_n = 0.2;
constexpr double kNoForce_n = 0.05;  ///< the reference at zero delay touches nothing if its force is below this value
constexpr double kMinPeakForce_n = 0.5;
constexpr double kMinPeakTorque_n_m = 0.01;  ///< torque of kMinPeakForce_n at a lever of 2 cm
constexpr double kMinLoadedTravel_m = 1e-4;
constexpr double kMinFit = 0.8;  ///< smallest R² of a line whose slope is used
constexpr double kHapticRate_hz = 1000;
constexpr double kSoftCorner_hz = 60;
/// Time tolerance for the comparison of a force step with the reference. The same step may occur earlier or later in
/// the reference, by this tolerance plus a round trip. The largest step of the reference in this interval is
/// subtracted.
constexpr Duration kSameInstant{from_seconds(0.1)};
constexpr Duration kReturn = std::chrono::milliseconds(500);

/// Returns the mean of `value` over the ticks for which `counts` is true, or NaN if there are none.
template <class Counts, class Value>
double mean_over(const std::vector<TickSample>& ticks, const Counts& counts, const Value& value) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    if (!counts(ticks[k])) continue;
    sum += value(k);
    ++count;
  }
  return count == 0 ? kUndefined : sum / static_cast<double>(count);
}

Vec3 displayed_force(const TickSample& tick) {
  return tick.displayed_D.f;
}
Vec3 displayed_torque(const TickSample& tick) {
  return tick.displayed_D.t;
}

bool is_any_tick(const TickSample& /*tick*/) {
  return true;
}

using Quantity = Vec3 (*)(const TickSample& tick);

/// Returns the RMS of the difference between `user` and `other` at equal times since the hands started. After the end
/// of a trace its last value is used.
template <class Counts>
double rms_difference(const UserTrace& user, const UserTrace& other, const Counts& counts, Quantity of) {
  if (other.ticks.empty()) return kUndefined;
  return std::sqrt(mean_over(user.ticks, counts, [&](std::size_t k) {
    return (of(user.ticks[k]) - of(other.ticks[std::min(k, other.ticks.size() - 1)])).squaredNorm();
  }));
}

double peak(const UserTrace& user, Quantity of) {
  double result = 0;
  for (const TickSample& tick : user.ticks) result = std::max(result, of(tick).norm());
  return result;
}

double path_error(const UserView& view, Quantity of) {
  return view.reference == nullptr ? kUndefined : rms_difference(view.user, *view.reference, is_any_tick, of);
}

double path_error_of_peak(const UserView& view, Quantity of, double least_peak) {
  if (view.reference == nullptr) return kUndefined;
  const double truth = peak(*view.reference, of);
  return truth < least_peak ? kUndefined : path_error(view, of) / truth;
}

double free_force_rms_n(const UserTrace& user) {
  const int move = phase_called(user, "move");
  return std::sqrt(mean_over(
      user.ticks, [move](const TickSample& tick) { return tick.phase == move; },
      [&](std::size_t k) { return user.ticks[k].displayed_D.f.squaredNorm(); }));
}

/// Predicate: whether the hand's phase at a tick is in contact; see contact_phases().
struct InContact {
  explicit InContact(const UserView& view) : phases(contact_phases(view)) {}
  bool operator()(const TickSample& tick) const {
    return tick.phase >= 0 && phases[static_cast<std::size_t>(tick.phase)];
  }
  std::vector<bool> phases;
};

double contact_force(const UserTrace& user, const InContact& in_contact) {
  return mean_over(user.ticks, in_contact, [&](std::size_t k) { return displayed_force_n(user.ticks[k]); });
}

/// Line fitted to the force as a function of the hand's position along a direction.
struct Slope {
  double n_per_m = kUndefined;
  double fit = 0;  ///< R² of the fitted line
  double travel_m = 0;
};

Vec3 mean_contact_force_D(const UserTrace& user, const InContact& in_contact) {
  Vec3 mean = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    mean[axis] = mean_over(user.ticks, in_contact, [&](std::size_t k) { return user.ticks[k].displayed_D.f[axis]; });
  }
  return mean;
}

Slope felt_slope(const UserTrace& user, const InContact& in_contact, const Vec3& direction) {
  const auto x = [&](std::size_t k) { return direction.dot(user.ticks[k].hand_D.p); };
  const auto f = [&](std::size_t k) { return direction.dot(user.ticks[k].displayed_D.f); };
  const double mean_x = mean_over(user.ticks, in_contact, x);
  const double mean_f = mean_over(user.ticks, in_contact, f);
  const double xx = mean_over(user.ticks, in_contact, [&](std::size_t k) { return std::pow(x(k) - mean_x, 2); });
  const double ff = mean_over(user.ticks, in_contact, [&](std::size_t k) { return std::pow(f(k) - mean_f, 2); });
  const double xf = mean_over(user.ticks, in_contact, [&](std::size_t k) { return (x(k) - mean_x) * (f(k) - mean_f); });
  return {xf / xx, xf * xf / (xx * ff), std::sqrt(xx)};
}

/// Returns, for each tick, the change of a quantity per millisecond. The quantity is the wrench before the slew limit.
std::vector<double> steps_per_ms(const UserTrace& user, Quantity of) {
  std::vector<double> steps(user.ticks.size(), 0.0);
  for (std::size_t k = 1; k < user.ticks.size(); ++k) {
    const TickSample& before = user.ticks[k - 1];
    const TickSample& now = user.ticks[k];
    steps[k] = (of(now) - of(before)).norm() / (to_seconds(now.time - before.time) * 1e3);
  }
  return steps;
}

/// Returns, for each element, the maximum of those elements of `values` that are at most `reach` positions away.
std::vector<double> greatest_around(const std::vector<double>& values, std::size_t reach) {
  std::vector<double> result(values.size());
  std::deque<std::size_t> falling;  // indices of candidates for the maximum, in descending order of value
  std::size_t next = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    for (; next < values.size() && next <= k + reach; ++next) {
      while (!falling.empty() && values[falling.back()] <= values[next]) falling.pop_back();
      falling.push_back(next);
    }
    while (falling.front() + reach < k) falling.pop_front();
    result[k] = values[falling.front()];
  }
  return result;
}

double step_beyond_reference(const UserView& view, Quantity of) {
  if (view.reference == nullptr || view.user.ticks.empty() || view.reference->ticks.empty()) return kUndefined;
  const std::vector<double> steps = steps_per_ms(view.user, of);
  const auto reach = static_cast<std::size_t>((kSameInstant + round_trip_of(view.user.user)) / kHapticPeriod);
  const std::vector<double> excused = greatest_around(steps_per_ms(*view.reference, of), reach);
  double greatest = 0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    greatest = std::max(greatest, steps[k] - excused[std::min(k, excused.size() - 1)]);
  }
  return greatest;
}

bool is_long_silence(const TickSample& tick) {
  return std::max(tick.state_age, tick.input_age) > from_seconds(kLongSilence_ms / 1e3);
}

double mean_hold_force_n(const UserTrace& user) {
  return user_metric(user, "hold_force_mean_n");
}

}  // namespace

std::vector<bool> contact_phases(const UserView& view) {
  const UserTrace& measured = view.reference != nullptr ? *view.reference : view.user;
  std::vector<bool> result;
  for (const std::string& name : view.user.user.hand.phases()) {
    const int phase = static_cast<int>(result.size());
    const bool is_a_way = name == "approach" || name == "move" || name == "retreat";
    const double mean = mean_over(
        measured.ticks, [phase](const TickSample& tick) { return tick.phase == phase; },
        [&](std::size_t k) { return displayed_force_n(measured.ticks[k]); });
    result.push_back(!is_a_way && mean >= kContactForce_n);
  }
  return result;
}

double free_drag_rms_n(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  return free_force_rms_n(view.user) - free_force_rms_n(*view.reference);
}

double contact_force_mean_n(const UserView& view) {
  return contact_force(view.user, InContact(view));
}

double contact_force_ratio(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  const InContact in_contact(view);
  return contact_force(view.user, in_contact) / contact_force(*view.reference, in_contact);
}

double contact_error_rms_n(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  return rms_difference(view.user, *view.reference, InContact(view), displayed_force);
}

double contact_error_fraction(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  return contact_error_rms_n(view) / contact_force(*view.reference, InContact(view));
}

double contact_delay_error_rms_n(const UserView& view) {
  if (view.same_stage == nullptr) return kUndefined;
  return rms_difference(view.user, *view.same_stage, InContact(view), displayed_force);
}

double path_error_rms_n(const UserView& view) {
  return path_error(view, displayed_force);
}

double path_error_of_peak(const UserView& view) {
  return path_error_of_peak(view, displayed_force, kMinPeakForce_n);
}

double path_torque_error_rms_n_m(const UserView& view) {
  return path_error(view, displayed_torque);
}

double path_torque_error_of_peak(const UserView& view) {
  return path_error_of_peak(view, displayed_torque, kMinPeakTorque_n_m);
}

double felt_stiffness_ratio(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  const InContact in_contact(view);
  const Vec3 force = mean_contact_force_D(*view.reference, in_contact);
  if (!(force.norm() > 0)) return kUndefined;
  const Slope expected = felt_slope(*view.reference, in_contact, force.normalized());
  if (!(expected.fit >= kMinFit) || !(expected.travel_m >= kMinLoadedTravel_m)) return kUndefined;
  return felt_slope(view.user, in_contact, force.normalized()).n_per_m / expected.n_per_m;
}

double hold_force_ratio(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  const double truth = mean_hold_force_n(*view.reference);
  return truth < kContactForce_n ? kUndefined : mean_hold_force_n(view.user) / truth;
}

double hold_force_least_ratio(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  const double truth = mean_hold_force_n(*view.reference);
  if (!(truth >= kContactForce_n)) return kUndefined;
  double least = kUndefined;
  for (const TickSample* tick : settled_hold_ticks(view.user)) least = std::fmin(least, displayed_force_n(*tick));
  return least / truth;
}

double force_step_max_n_per_ms(const UserView& view) {
  return step_beyond_reference(view, [](const TickSample& tick) -> Vec3 { return tick.stage_D.f; });
}

double return_step_max_n_per_ms(const UserView& view) {
  const auto& ticks = view.user.ticks;
  const std::vector<double> steps =
      steps_per_ms(view.user, [](const TickSample& tick) -> Vec3 { return tick.displayed_D.f; });
  double greatest = kUndefined;
  std::optional<Duration> ended;
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    const bool was_silent = is_long_silence(ticks[k - 1]);
    const bool is_silent = is_long_silence(ticks[k]);
    if (was_silent && !is_silent) ended = ticks[k].time;
    if (ended && !is_silent && ticks[k].time - *ended < kReturn) greatest = std::fmax(greatest, steps[k]);
  }
  return greatest;
}

double torque_step_max_n_m_per_ms(const UserView& view) {
  return step_beyond_reference(view, [](const TickSample& tick) -> Vec3 { return tick.stage_D.t; });
}

double ghost_contact_ms(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  const auto& ticks = view.user.ticks;
  const auto& other = view.reference->ticks;
  Duration longest{0};
  Duration since{0};
  bool was_ghost = false;
  for (std::size_t k = 0; k < std::min(ticks.size(), other.size()); ++k) {
    const bool is_ghost = displayed_force_n(ticks[k]) > kGhostForce_n && displayed_force_n(other[k]) < kNoForce_n;
    if (is_ghost && !was_ghost) since = ticks[k].time;
    if (is_ghost) longest = std::max(longest, ticks[k].time - since + kHapticPeriod);
    was_ghost = is_ghost;
  }
  return to_seconds(longest) * 1e3;
}

double force_above_60_hz_n(const UserView& view) {
  const InContact in_contact(view);
  double square = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> force;
    for (const TickSample& tick : view.user.ticks) force.push_back(tick.displayed_D.f[axis]);
    if (force.empty()) return kUndefined;
    const std::vector<double> above = high_passed(force, kHapticRate_hz, kSoftCorner_hz);
    square += mean_over(view.user.ticks, in_contact, [&](std::size_t k) { return above[k] * above[k]; });
  }
  return std::sqrt(square);
}

}  // namespace tandem::lab

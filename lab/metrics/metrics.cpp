#include "lab/metrics/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::lab {
namespace {

template <class Ticks, class Value>
double greatest(const Ticks& ticks, Value value) {
  double result = kUndefined;
  for (const auto& tick : ticks) result = std::fmax(result, value(tick));
  return result;
}

template <class Ticks, class Value>
double mean(const Ticks& ticks, Value value) {
  double sum = 0;
  for (const auto& tick : ticks) sum += value(tick);
  return ticks.empty() ? kUndefined : sum / static_cast<double>(ticks.size());
}

template <class Ticks, class Value>
double rms(const Ticks& ticks, Value value) {
  return std::sqrt(mean(ticks, [&](const auto& tick) { return value(tick) * value(tick); }));
}

double torque_n_m(const TickSample& tick) {
  return tick.displayed_D.t.norm();
}
double speed_m_per_s(const TickSample& tick) {
  return tick.hand_twist_D.v.norm();
}
double turn_rate_rad_per_s(const TickSample& tick) {
  return tick.hand_twist_D.w.norm();
}
double deviation_m(const TickSample& tick) {
  return (tick.hand_D.p - tick.intended_D).norm();
}
double state_age_ms(const TickSample& tick) {
  return to_seconds(tick.state_age) * 1e3;
}
double round_trip_ms(const TickSample& tick) {
  return to_seconds(tick.round_trip) * 1e3;
}

// Calls the function F of a sample with a pointer to the sample, because settled_hold_ticks() returns pointers.
template <double (*F)(const TickSample&)>
double of_pointer(const TickSample* tick) {
  return F(*tick);
}

double ticks_with(const UserTrace& user, haptics::SafetyFaults fault) {
  return static_cast<double>(std::count_if(user.ticks.begin(), user.ticks.end(),
                                           [&](const TickSample& tick) { return (tick.safety_faults & fault) != 0; }));
}

/// Safety faults that would stop a real device. The start ramp, the slew limit and silences of the link are excluded,
/// because they occur in normal operation.
constexpr haptics::SafetyFaults kRealFaults =
    haptics::kSafetyNotFinite | haptics::kSafetyTooFast | haptics::kSafetyInvalidSample;

double clamped_fraction(const UserTrace& user) {
  return mean(user.ticks, [](const TickSample& tick) { return tick.is_clamped ? 1.0 : 0.0; });
}

double hold_mean_force(const UserTrace& user) {
  return mean(settled_hold_ticks(user), of_pointer<displayed_force_n>);
}

double hold_force_deviation(const UserTrace& user) {
  const auto ticks = settled_hold_ticks(user);
  const double centre = mean(ticks, of_pointer<displayed_force_n>);
  return rms(ticks, [&](const TickSample* tick) { return displayed_force_n(*tick) - centre; });
}

double free_force(const UserTrace& user) {
  const int move = phase_called(user, "move");
  std::vector<const TickSample*> ticks;
  for (const TickSample& tick : user.ticks) {
    if (tick.phase == move) ticks.push_back(&tick);
  }
  return rms(ticks, of_pointer<displayed_force_n>);
}

double state_age_quantile(const UserTrace& user, double q) {
  std::vector<double> ages;
  for (const TickSample& tick : user.ticks) {
    if (tick.state_age >= Duration(0)) ages.push_back(state_age_ms(tick));
  }
  if (ages.empty()) return kUndefined;
  const auto rank = static_cast<std::ptrdiff_t>(q * static_cast<double>(ages.size() - 1));
  std::nth_element(ages.begin(), ages.begin() + rank, ages.end());
  return ages[static_cast<std::size_t>(rank)];
}

}  // namespace

std::vector<const TickSample*> settled_hold_ticks(const UserTrace& user) {
  const int hold = phase_called(user, "hold");
  std::vector<const TickSample*> settled;
  Duration since{0};
  bool was_hold = false;
  for (const TickSample& tick : user.ticks) {
    const bool is_hold = tick.phase == hold;
    if (is_hold && !was_hold) since = tick.time;
    if (is_hold && tick.time - since >= kSettling) settled.push_back(&tick);
    was_hold = is_hold;
  }
  return settled;
}

const std::vector<UserMetric>& user_metrics() {
  static const std::vector<UserMetric> metrics = {
      {"force_rms_n", "rms of the displayed force, all ticks",
       [](const UserTrace& u) { return rms(u.ticks, displayed_force_n); }},
      {"force_max_n", "largest displayed force, all ticks",
       [](const UserTrace& u) { return greatest(u.ticks, displayed_force_n); }},
      {"torque_rms_n_m", "rms of the displayed torque, all ticks",
       [](const UserTrace& u) { return rms(u.ticks, torque_n_m); }},
      {"torque_max_n_m", "largest displayed torque, all ticks",
       [](const UserTrace& u) { return greatest(u.ticks, torque_n_m); }},
      {"clamped_fraction", "fraction of ticks in which the force was clamped to the device's limit", clamped_fraction},
      {"move_force_rms_n", "rms of the displayed force in the move phase: drag in free motion, caused by the delay",
       free_force},
      {"hold_force_mean_n", "mean displayed force, settled hold phase", hold_mean_force},
      {"hold_force_deviation_n", "standard deviation of the displayed force, settled hold phase", hold_force_deviation},
      {"hold_torque_mean_n_m", "mean displayed torque, settled hold phase",
       [](const UserTrace& u) { return mean(settled_hold_ticks(u), of_pointer<torque_n_m>); }},
      {"hold_speed_rms_m_per_s", "rms of the hand's true speed, settled hold phase",
       [](const UserTrace& u) { return rms(settled_hold_ticks(u), of_pointer<speed_m_per_s>); }},
      {"hold_speed_max_m_per_s", "largest true speed of the hand, settled hold phase: high in a limit cycle",
       [](const UserTrace& u) { return greatest(settled_hold_ticks(u), of_pointer<speed_m_per_s>); }},
      {"hold_turn_rate_rms_rad_per_s", "rms of the hand's true rate of rotation, settled hold phase",
       [](const UserTrace& u) { return rms(settled_hold_ticks(u), of_pointer<turn_rate_rad_per_s>); }},
      {"hold_deviation_mean_m", "mean distance of the hand from the intended trajectory, settled hold phase",
       [](const UserTrace& u) { return mean(settled_hold_ticks(u), of_pointer<deviation_m>); }},
      {"slew_limited_ticks", "ticks in which the slew limit reduced the change of the force",
       [](const UserTrace& u) { return ticks_with(u, haptics::kSafetySlewed); }},
      {"silent_ticks", "ticks in which the force decayed because the newest state was too old",
       [](const UserTrace& u) { return ticks_with(u, haptics::kSafetySilence); }},
      {"safety_fault_ticks", "ticks with a value that is not finite, a hand that is too fast, or an invalid sample",
       [](const UserTrace& u) { return ticks_with(u, kRealFaults); }},
      {"energy_to_hand_j", "work done on the hand", [](const UserTrace& u) { return u.energy_to_hand_j; }},
      {"energy_from_hand_j", "work done by the hand", [](const UserTrace& u) { return u.energy_from_hand_j; }},
      {"state_age_median_ms", "median age of the newest server state",
       [](const UserTrace& u) { return state_age_quantile(u, 0.5); }},
      {"state_age_p99_ms", "99 % quantile of the age of the newest server state",
       [](const UserTrace& u) { return state_age_quantile(u, 0.99); }},
      {"round_trip_mean_ms", "mean round trip, as the client measures it",
       [](const UserTrace& u) { return mean(u.ticks, round_trip_ms); }},
      {"round_trip_max_ms", "largest round trip, as the client measures it",
       [](const UserTrace& u) { return greatest(u.ticks, round_trip_ms); }},
  };
  return metrics;
}

double user_metric(const UserTrace& user, std::string_view name) {
  for (const UserMetric& metric : user_metrics()) {
    if (metric.name == name) return metric.value_of(user);
  }
  throw std::invalid_argument("metric \"" + std::string(name) + "\" is not known; see trial.json for the names");
}

int phase_called(const UserTrace& user, std::string_view name) {
  const auto& phases = user.user.hand.phases();
  const auto found = std::find(phases.begin(), phases.end(), name);
  return found == phases.end() ? -2 : static_cast<int>(found - phases.begin());
}

std::vector<double> body_travel_m(const SessionTrace& trace, std::size_t body) {
  std::vector<double> travel_m;
  for (const BodiesSample& sample : trace.bodies) {
    travel_m.push_back((sample.X_WB[body].p - trace.bodies.front().X_WB[body].p).norm());
  }
  return travel_m;
}

}  // namespace tandem::lab

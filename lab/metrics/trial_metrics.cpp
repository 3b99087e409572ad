#include "lab/metrics/trial_metrics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "lab/metrics/energy_bound.hpp"
#include "lab/metrics/energy_ledger.hpp"
#include "lab/metrics/felt_mass.hpp"
#include "lab/metrics/high_pass.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/metrics/squeeze_bound.hpp"

namespace tandem::lab {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kMinExchange_j = 0.020;  ///< below this a share of what was exchanged says nothing
constexpr double kGhostForce_n = 0.2;     ///< felt, where …
constexpr double kNoForce_n = 0.05;       ///< … the run at zero delay has next to none
constexpr double kMinLoadedTravel_m = 1e-4;
constexpr double kMinFit = 0.8;  ///< R²
constexpr double kHapticRate_hz = 1000;
constexpr double kSoftCorner_hz = 60;

double force_n(const TickSample& tick) {
  return tick.displayed_D.f.norm();
}

/// Mean of `value` of the ticks that `counts` lets through; NaN when there are none.
template <class Counts, class Value>
double mean_over(const std::vector<TickSample>& ticks, const Counts& counts, const Value& value) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    if (!counts(ticks[k])) continue;
    sum += value(k);
    ++count;
  }
  return count == 0 ? kNothing : sum / static_cast<double>(count);
}

template <class Value>
double greatest_of(const UserTrace& user, const Value& value) {
  double result = kNothing;
  for (std::size_t k = 0; k < user.ticks.size(); ++k) result = std::fmax(result, value(k));
  return result;
}

int phase_called(const UserTrace& user, std::string_view name) {
  const auto& phases = user.user.hand.phases();
  const auto found = std::find(phases.begin(), phases.end(), name);
  return found == phases.end() ? -2 : static_cast<int>(found - phases.begin());
}

double free_force_rms_n(const UserTrace& user) {
  const int move = phase_called(user, "move");
  return std::sqrt(mean_over(
      user.ticks, [move](const TickSample& tick) { return tick.phase == move; },
      [&](std::size_t k) { return user.ticks[k].displayed_D.f.squaredNorm(); }));
}

double free_drag_rms_n(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  return free_force_rms_n(view.user) - free_force_rms_n(*view.reference);
}

/// Whether ticks of a phase are in contact; see contact_phases().
struct InContact {
  explicit InContact(const UserView& view) : phases(contact_phases(view)) {}
  bool operator()(const TickSample& tick) const {
    return tick.phase >= 0 && phases[static_cast<std::size_t>(tick.phase)];
  }
  std::vector<bool> phases;
};

double contact_force(const UserTrace& user, const InContact& in_contact) {
  return mean_over(user.ticks, in_contact, [&](std::size_t k) { return force_n(user.ticks[k]); });
}

double contact_force_mean_n(const UserView& view) {
  return contact_force(view.user, InContact(view));
}

double contact_force_ratio(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  const InContact in_contact(view);
  return contact_force(view.user, in_contact) / contact_force(*view.reference, in_contact);
}

double contact_error_rms_n(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  const auto& other = view.reference->ticks;
  const double square = mean_over(view.user.ticks, InContact(view), [&](std::size_t k) {
    if (other.empty()) return kNothing;
    const TickSample& reference = other[std::min(k, other.size() - 1)];
    return (view.user.ticks[k].displayed_D.f - reference.displayed_D.f).squaredNorm();
  });
  return std::sqrt(square);
}

double contact_error_fraction(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  return contact_error_rms_n(view) / contact_force(*view.reference, InContact(view));
}

/// Slope of force against the hand's position along a direction [N/m].
struct Slope {
  double n_per_m = kNothing;
  double fit = 0;  ///< R²
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

double felt_stiffness_ratio(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  const InContact in_contact(view);
  const Vec3 force = mean_contact_force_D(*view.reference, in_contact);
  if (!(force.norm() > 0)) return kNothing;
  const Slope expected = felt_slope(*view.reference, in_contact, force.normalized());
  if (!(expected.fit >= kMinFit) || !(expected.travel_m >= kMinLoadedTravel_m)) return kNothing;
  return felt_slope(view.user, in_contact, force.normalized()).n_per_m / expected.n_per_m;
}

double felt_mass_ratio(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  return felt_mass(view.user).mass_kg / felt_mass(*view.reference).mass_kg;
}

double felt_mass_interval_fraction(const UserView& view) {
  const FeltMass felt = felt_mass(view.user);
  return felt.half_width_kg / std::abs(felt.mass_kg);
}

double limit_cycle_m_per_s(const UserView& view) {
  return user_metric(view.user, "hold_speed_rms_m_per_s");
}

double peak_force_n(const UserView& view) {
  return greatest_of(view.user, [&](std::size_t k) { return force_n(view.user.ticks[k]); });
}

double force_step_n_per_ms(const UserTrace& user) {
  return greatest_of(user, [&](std::size_t k) {
    if (k == 0) return kNothing;
    const TickSample& before = user.ticks[k - 1];
    const TickSample& now = user.ticks[k];
    return (now.stage_D.f - before.stage_D.f).norm() / (to_seconds(now.time - before.time) * 1e3);
  });
}

double force_step_max_n_per_ms(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  return std::max(0.0, force_step_n_per_ms(view.user) - force_step_n_per_ms(*view.reference));
}

double slew_activations(const UserView& view) {
  return user_metric(view.user, "slew_limited_ticks");
}

double ghost_contact_ms(const UserView& view) {
  if (view.reference == nullptr) return kNothing;
  const auto& ticks = view.user.ticks;
  const auto& other = view.reference->ticks;
  Duration longest{0};
  Duration since{0};
  bool was_ghost = false;
  for (std::size_t k = 0; k < std::min(ticks.size(), other.size()); ++k) {
    const bool is_ghost = force_n(ticks[k]) > kGhostForce_n && force_n(other[k]) < kNoForce_n;
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
    if (force.empty()) return kNothing;
    const std::vector<double> above = high_passed(force, kHapticRate_hz, kSoftCorner_hz);
    square += mean_over(view.user.ticks, in_contact, [&](std::size_t k) { return above[k] * above[k]; });
  }
  return std::sqrt(square);
}

double passivity_dissipated_fraction(const UserView& view) {
  const double exchanged_j =
      (view.user.energy_to_hand_j + view.user.energy_from_hand_j) / view.user.hand_joules_per_world_joule;
  return exchanged_j < kMinExchange_j ? kNothing : view.user.passivity_dissipated_j / exchanged_j;
}

double tool_energy_limited_fraction(const UserView& view) {
  const auto limited = std::count_if(view.user.ticks.begin(), view.user.ticks.end(), is_tool_energy_limited);
  return view.user.ticks.empty() ? kNothing
                                 : static_cast<double>(limited) / static_cast<double>(view.user.ticks.size());
}

double hand_port_j(const UserView& view) {
  return (view.user.energy_to_hand_j - view.user.energy_from_hand_j) / view.user.hand_joules_per_world_joule;
}

double per_second(const UserView& view, std::uint64_t count) {
  return static_cast<double>(count) / to_seconds(view.experiment.duration);
}

double energy_created_max_j(const TrialView& view) {
  return view.trace.stored.empty() ? kNothing : energy_ledger(view.trace).created_max_j;
}

double energy_corrected_j(const TrialView& view) {
  return view.trace.stored.empty() ? kNothing : energy_ledger(view.trace).corrected_j;
}

double energy_withheld_by_safety_j(const TrialView& view) {
  return view.trace.stored.empty() ? kNothing : energy_ledger(view.trace).withheld_by_safety_j;
}

/// Where a user saw the watched body at `time`, straight between ticks. `from` is where the search begins.
std::optional<Vec3> view_at(const UserTrace& user, Duration time, std::size_t& from) {
  while (from + 1 < user.ticks.size() && user.ticks[from + 1].time <= time) ++from;
  if (from + 1 >= user.ticks.size()) return std::nullopt;
  const TickSample& before = user.ticks[from];
  const TickSample& after = user.ticks[from + 1];
  if (time < before.time || !before.has_view || !after.has_view) return std::nullopt;
  const double share = to_seconds(time - before.time) / to_seconds(after.time - before.time);
  return before.view_W + share * (after.view_W - before.view_W);
}

double divergence_of(const UserTrace& a, const UserTrace& b) {
  double greatest = kNothing;
  std::size_t from = 0;
  for (const TickSample& tick : a.ticks) {
    if (!tick.has_view) continue;
    const auto other = view_at(b, tick.time, from);
    if (other) greatest = std::fmax(greatest, (tick.view_W - *other).norm());
  }
  return greatest;
}

double view_divergence_max_m(const TrialView& view) {
  double greatest = kNothing;
  for (std::size_t i = 0; i < view.trace.users.size(); ++i) {
    for (std::size_t j = i + 1; j < view.trace.users.size(); ++j) {
      greatest = std::fmax(greatest, divergence_of(view.trace.users[i], view.trace.users[j]));
    }
  }
  return greatest;
}

double combined(Combine combine, const std::vector<double>& values) {
  if (values.empty()) return kNothing;
  const auto farther = [](double a, double b) { return std::abs(a - 1) < std::abs(b - 1); };
  double sum = 0;
  for (const double value : values) sum += value;
  switch (combine) {
    case Combine::kGreatest:
      return *std::max_element(values.begin(), values.end());
    case Combine::kLeast:
      return *std::min_element(values.begin(), values.end());
    case Combine::kFarthestFromOne:
      return *std::max_element(values.begin(), values.end(), farther);
    case Combine::kMean:
      return sum / static_cast<double>(values.size());
    case Combine::kSum:
      break;
  }
  return sum;
}

double height_m(const SessionTrace& trace, const BodiesSample& sample, std::size_t body) {
  return sample.X_WB[body].p.z() - trace.bodies.front().X_WB[body].p.z();
}

/// Index of the rule's body; none: not there, or nothing is known of it.
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

}  // namespace

std::string_view name_of(Combine combine) {
  constexpr std::array<std::string_view, 5> kNames{"greatest of the users", "least of the users", "mean of the users",
                                                   "sum over the users", "the user's that is farthest from 1"};
  return kNames.at(static_cast<std::size_t>(combine));
}

std::vector<bool> contact_phases(const UserView& view) {
  const UserTrace& judge = view.reference != nullptr ? *view.reference : view.user;
  std::vector<bool> result;
  for (const std::string& name : view.user.user.hand.phases()) {
    const int phase = static_cast<int>(result.size());
    const bool is_a_way = name == "approach" || name == "move" || name == "retreat";
    const double mean = mean_over(
        judge.ticks, [phase](const TickSample& tick) { return tick.phase == phase; },
        [&](std::size_t k) { return force_n(judge.ticks[k]); });
    result.push_back(!is_a_way && mean >= kContactForce_n);
  }
  return result;
}

// NOLINTNEXTLINE(readability-function-size): one table
const std::vector<TrialMetric>& trial_metrics() {
  static const std::vector<TrialMetric> metrics = {
      {"free_drag_rms_n",
       "RMS of the displayed force in the phase \"move\", less that of the same hand at zero delay: what moving "
       "through nothing costs.",
       Combine::kGreatest, free_drag_rms_n},
      {"contact_force_mean_n",
       "Mean displayed force in the phases in contact: all but \"approach\", \"move\" and \"retreat\" in which the "
       "run at zero delay shows 0.1 N or more on average.",
       Combine::kMean, contact_force_mean_n},
      {"contact_force_ratio", "That mean over the mean of the same hand at zero delay: how much of a touch is left.",
       Combine::kLeast, contact_force_ratio},
      {"contact_error_rms_n",
       "RMS of the difference between the displayed force and that of the same hand at zero delay at the same time "
       "since the hands started, in the phases in contact.",
       Combine::kGreatest, contact_error_rms_n},
      {"contact_error_fraction", "That RMS over the mean force of the run at zero delay in the same phases.",
       Combine::kGreatest, contact_error_fraction},
      {"felt_stiffness_ratio",
       "Slope of displayed force against position of the hand (least squares, along the mean force of the run at zero "
       "delay, phases in contact), over that of the run at zero delay. Null where that run's slope is no line (R² "
       "below 0.8) or the hand hardly moves along it.",
       Combine::kFarthestFromOne, felt_stiffness_ratio},
      {"felt_mass_kg",
       "Mass that the hand feels in the phase \"shake\" (0.5–5 Hz), by regression of displayed force on "
       "the hand's acceleration, velocity and position.",
       Combine::kMean, [](const UserView& view) { return felt_mass(view.user).mass_kg; }},
      {"felt_mass_ratio", "That mass over the mass in the run at zero delay.", Combine::kFarthestFromOne,
       felt_mass_ratio},
      {"felt_mass_interval_fraction",
       "Half the 95 % confidence interval of that mass (Newey and West, 0.2 s), over the mass.", Combine::kGreatest,
       felt_mass_interval_fraction},
      {"limit_cycle_m_per_s", "RMS of the hand's true speed in the phase \"hold\" after its first second.",
       Combine::kGreatest, limit_cycle_m_per_s},
      {"hold_force_mean_n", "Mean displayed force in the phase \"hold\" after its first second.", Combine::kLeast,
       [](const UserView& view) { return user_metric(view.user, "hold_force_mean_n"); }},
      {"hold_force_bound_n",
       "Of two users of a local model who squeeze a thing: what that could be at most with passive joints between the "
       "copies of the thing; from the round trip and the run at zero delay (squeeze_bound.hpp).",
       Combine::kLeast, nullptr, hold_force_bound_n},
      {"peak_force_n", "Greatest displayed force.", Combine::kGreatest, peak_force_n},
      {"force_step_max_n_per_ms",
       "Greatest change of the computed force in a millisecond, before the slew limit, beyond the greatest of the same "
       "hand at zero delay; 0 when it is no greater.",
       Combine::kGreatest, force_step_max_n_per_ms},
      {"slew_activations", "Ticks in which the slew limit held the force back.", Combine::kSum, slew_activations},
      {"ghost_contact_ms",
       "Longest time for which more than 0.2 N is displayed where the same hand at zero delay feels less than 0.05 N.",
       Combine::kGreatest, ghost_contact_ms},
      {"force_above_60_hz_n", "RMS of the displayed force above 60 Hz (Butterworth, order 8), phases in contact.",
       Combine::kGreatest, force_above_60_hz_n},
      {"energy_created_max_j",
       "Greatest E(t) = Σ over users of Σ F_k·(x_{k+1} − x_k) + energy stored for them − the same at the start, in "
       "world "
       "joules, F_k the wrench after the passivity controller: what came from nowhere. Stored: in a user's local "
       "model, else in the "
       "server's "
       "world (energy_ledger.hpp).",
       Combine::kGreatest, nullptr, energy_created_max_j},
      {"energy_created_bound_j",
       "What that can be at most where the loop is closed through the network: Σ |F·Δx − A·Δh| over inputs, A the "
       "server's answer to the same input and h its handle, and what jumps of the handle and inputs on their way hold "
       "(energy_bound.hpp); 0 of waves, null of local models.",
       Combine::kGreatest, nullptr, [](const TrialView& view) { return energy_created_bound_j(view.trace); }},
      {"energy_corrected_j",
       "What corrections of local models towards the server put into them over the trial, in world joules; contained "
       "in energy_created_max_j.",
       Combine::kGreatest, nullptr, energy_corrected_j},
      {"energy_withheld_by_safety_j",
       "Work on the hands that ramp, decay in silence, slew limit and clamp left out, in world joules; a line of its "
       "own, "
       "for E(t) is of the force before them.",
       Combine::kGreatest, nullptr, energy_withheld_by_safety_j},
      {"hand_port_j", "Work done on the hand over the trial, in world joules; less than 0 when it gave.", Combine::kSum,
       hand_port_j},
      {"passivity_dissipated_fraction",
       "What the passivity controller withheld, over what hand and display exchanged in both directions; null below 20 "
       "mJ "
       "exchanged.",
       Combine::kGreatest, passivity_dissipated_fraction},
      {"tool_energy_limited_fraction",
       "Share of the trial in which the room limited a tool that would have put more into the world than its user's "
       "hand put in.",
       Combine::kGreatest, tool_energy_limited_fraction},
      {"view_divergence_max_m",
       "Greatest distance between where two users see the watched body at the same instant. It contains what the body "
       "moves in the difference of their delays.",
       Combine::kGreatest, nullptr, view_divergence_max_m},
      {"datagrams_per_s", "Datagrams of client and server, lost ones too.", Combine::kSum,
       [](const UserView& view) { return per_second(view, view.user.traffic.datagrams); }},
      {"bytes_per_s", "Bytes of datagrams and control in both directions, without headers of UDP, TCP and IP.",
       Combine::kSum, [](const UserView& view) { return per_second(view, view.user.traffic.bytes); }},
  };
  return metrics;
}

UserView view_of_user(const TrialView& trial, std::size_t user) {
  return {trial.experiment, trial.trace.users[user],
          trial.reference != nullptr ? &trial.reference->users[user] : nullptr};
}

double value_of(const TrialMetric& metric, const TrialView& trial) {
  if (metric.of_trial != nullptr) return metric.of_trial(trial);
  std::vector<double> values;
  for (std::size_t i = 0; i < trial.trace.users.size(); ++i) {
    const double value = metric.of_user(view_of_user(trial, i));
    if (std::isfinite(value)) values.push_back(value);
  }
  return combined(metric.combine, values);
}

double trial_metric(const TrialView& trial, std::string_view name) {
  for (const TrialMetric& metric : trial_metrics()) {
    if (metric.name == name) return value_of(metric, trial);
  }
  throw std::invalid_argument("metric \"" + std::string(name) + "\" is not known; see lab/metrics/trial_metrics.cpp");
}

std::string outcome_of(const Experiment& experiment, const SessionTrace& trace) {
  for (const UserTrace& user : trace.users) {
    if (!user.stayed_connected) return "lost";
  }
  if (!experiment.outcome) return "completed";
  const OutcomeRule& rule = *experiment.outcome;
  return rule.ends_at_W ? place_outcome(rule, trace) : lift_outcome(rule, trace);
}

}  // namespace tandem::lab

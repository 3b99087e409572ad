#include "lab/metrics/trial_metrics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "lab/metrics/energy_ledger.hpp"
#include "lab/metrics/felt_mass.hpp"
#include "lab/metrics/metrics.hpp"
#include "lab/metrics/touch_errors.hpp"

namespace tandem::lab {
namespace {

/// Minimum exchanged energy of a trial for which the dissipated fraction is defined [J].
constexpr double kMinExchange_j = 0.020;

// Names of the metrics in metrics.cpp that need the trace of one user only.
constexpr char kHoldSpeed[] = "hold_speed_rms_m_per_s";
constexpr char kHoldTurnRate[] = "hold_turn_rate_rms_rad_per_s";
constexpr char kHoldForce[] = "hold_force_mean_n";
constexpr char kPeakForce[] = "force_max_n";
constexpr char kSlewed[] = "slew_limited_ticks";

template <const char* kName>
double of_user(const UserView& view) {
  return user_metric(view.user, kName);
}

double silence_max_ms(const UserView& view) {
  Duration longest{0};
  for (const TickSample& tick : view.user.ticks) longest = std::max({longest, tick.state_age, tick.input_age});
  return to_seconds(longest) * 1e3;
}

double felt_mass_ratio(const UserView& view) {
  if (view.reference == nullptr) return kUndefined;
  return felt_mass(view.user).mass_kg / felt_mass(*view.reference).mass_kg;
}

double felt_mass_interval_fraction(const UserView& view) {
  const FeltMass felt = felt_mass(view.user);
  return felt.half_width_kg / std::abs(felt.mass_kg);
}

double passivity_dissipated_fraction(const UserView& view) {
  const double exchanged_j =
      (view.user.energy_to_hand_j + view.user.energy_from_hand_j) / view.user.hand_joules_per_world_joule;
  return exchanged_j < kMinExchange_j ? kUndefined : view.user.passivity_dissipated_j / exchanged_j;
}

double tool_energy_limited_fraction(const UserView& view) {
  const auto limited = std::count_if(view.user.ticks.begin(), view.user.ticks.end(), is_tool_energy_limited);
  return view.user.ticks.empty() ? kUndefined
                                 : static_cast<double>(limited) / static_cast<double>(view.user.ticks.size());
}

double hand_port_j(const UserView& view) {
  return (view.user.energy_to_hand_j - view.user.energy_from_hand_j) / view.user.hand_joules_per_world_joule;
}

double per_second(const UserView& view, std::uint64_t count) {
  return static_cast<double>(count) / to_seconds(view.experiment.duration);
}

/// Returns one value of the trial's energy ledger as a metric.
template <double EnergyLedger::*kNumber>
double of_ledger(const TrialView& view) {
  const auto has_answers = [](const UserTrace& user) { return !user.answered.empty(); };
  return std::any_of(view.trace.users.begin(), view.trace.users.end(), has_answers) ? energy_ledger(view.trace).*kNumber
                                                                                    : kUndefined;
}

double energy_of_late_display_j(const TrialView& view) {
  return view.reference != nullptr ? late_energy_j(*view.reference, view.trace) : kUndefined;
}

/// Returns the position of the watched body as displayed to a user at `time`, interpolated between ticks. The search
/// starts at tick `from` and advances it, so `time` must not decrease between calls.
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
  double greatest = kUndefined;
  std::size_t from = 0;
  for (const TickSample& tick : a.ticks) {
    if (!tick.has_view) continue;
    const auto other = view_at(b, tick.time, from);
    if (other) greatest = std::fmax(greatest, (tick.view_W - *other).norm());
  }
  return greatest;
}

double view_divergence_max_m(const TrialView& view) {
  double greatest = kUndefined;
  for (std::size_t i = 0; i < view.trace.users.size(); ++i) {
    for (std::size_t j = i + 1; j < view.trace.users.size(); ++j) {
      greatest = std::fmax(greatest, divergence_of(view.trace.users[i], view.trace.users[j]));
    }
  }
  return greatest;
}

double combined(Combine combine, const std::vector<double>& values) {
  if (values.empty()) return kUndefined;
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

}  // namespace

std::string_view name_of(Combine combine) {
  constexpr std::array<std::string_view, 5> kNames{"greatest of the users", "least of the users", "mean of the users",
                                                   "sum over the users", "the user's that is farthest from 1"};
  return kNames.at(static_cast<std::size_t>(combine));
}

// NOLINTNEXTLINE(readability-function-size): one table
const std::vector<TrialMetric>& trial_metrics() {
  static const std::vector<TrialMetric> metrics = {
      {"free_drag_rms_n",
       "RMS of the displayed force in the phase \"move\" minus that of the reference: the force felt in free motion.",
       Combine::kGreatest, free_drag_rms_n},
      {"contact_force_mean_n",
       "Mean displayed force in the phases in contact: all but \"approach\", \"move\" and \"retreat\" in which the "
       "reference shows 0.1 N or more on average.",
       Combine::kMean, contact_force_mean_n},
      {"contact_force_ratio",
       "contact_force_mean_n divided by the same mean of the reference. If it is below 0.5 for any user, the outcome "
       "is "
       "\"weak\".",
       Combine::kLeast, contact_force_ratio},
      {"contact_error_rms_n",
       "RMS of the difference between the displayed force and the reference's at the same time since the hands "
       "started, in the phases in contact.",
       Combine::kGreatest, contact_error_rms_n},
      {"contact_error_fraction", "contact_error_rms_n divided by the mean force of the reference in the same phases.",
       Combine::kGreatest, contact_error_fraction},
      {"contact_delay_error_rms_n",
       "As contact_error_rms_n, against the same stage at zero delay: the effect of delay, jitter and loss. Errors "
       "that the stage makes at any delay cancel.",
       Combine::kGreatest, contact_delay_error_rms_n},
      {"path_error_rms_n",
       "RMS of the difference between the displayed force and the reference's over the whole path: approach, move, "
       "contact and retreat.",
       Combine::kGreatest, path_error_rms_n},
      {"path_error_of_peak",
       "path_error_rms_n divided by the greatest force of the reference; null if this force is below 0.5 N.",
       Combine::kGreatest, path_error_of_peak},
      {"path_torque_error_rms_n_m", "As path_error_rms_n, for the torque.", Combine::kGreatest,
       path_torque_error_rms_n_m},
      {"path_torque_error_of_peak",
       "path_torque_error_rms_n_m divided by the greatest torque of the reference; null if this torque is below 10 "
       "mN·m.",
       Combine::kGreatest, path_torque_error_of_peak},
      {"felt_stiffness_ratio",
       "Slope of displayed force against position of the hand (least squares, along the mean force of the reference, "
       "phases in contact), divided by that of the reference. Null if the points are not on a line (R² below 0.8) or "
       "the hand hardly moves along it.",
       Combine::kFarthestFromOne, felt_stiffness_ratio},
      {"felt_mass_kg",
       "Mass that the hand feels in the phase \"shake\" (0.5–5 Hz), by regression of displayed force on "
       "the hand's acceleration, velocity and position.",
       Combine::kMean, [](const UserView& view) { return felt_mass(view.user).mass_kg; }},
      {"felt_mass_ratio", "felt_mass_kg divided by the mass felt in the reference.", Combine::kFarthestFromOne,
       felt_mass_ratio},
      {"felt_mass_interval_fraction",
       "Half the 95 % confidence interval of felt_mass_kg (Newey and West, 0.2 s), divided by felt_mass_kg.",
       Combine::kGreatest, felt_mass_interval_fraction},
      {"limit_cycle_m_per_s", "RMS of the hand's true speed in the phase \"hold\" after its first second.",
       Combine::kGreatest, of_user<kHoldSpeed>},
      {"limit_cycle_rad_per_s", "RMS of the hand's true angular speed in the phase \"hold\" after its first second.",
       Combine::kGreatest, of_user<kHoldTurnRate>},
      {"hold_force_mean_n", "Mean displayed force in the phase \"hold\" after its first second.", Combine::kLeast,
       of_user<kHoldForce>},
      {"hold_force_ratio",
       "hold_force_mean_n divided by the same mean of the reference; null if the latter is below 0.1 N.",
       Combine::kLeast, hold_force_ratio},
      {"hold_force_least_ratio",
       "Least displayed force in the phase \"hold\" after its first second, divided by the mean of the reference.",
       Combine::kLeast, hold_force_least_ratio},
      {"peak_force_n", "Greatest displayed force.", Combine::kGreatest, of_user<kPeakForce>},
      {"force_step_max_n_per_ms",
       "Greatest change of the computed force in a millisecond, before the slew limit, beyond the greatest of the "
       "reference at that instant (0.1 s and a round trip before or after it); 0 when it is no greater.",
       Combine::kGreatest, force_step_max_n_per_ms},
      {"torque_step_max_n_m_per_ms", "As force_step_max_n_per_ms, for the torque.", Combine::kGreatest,
       torque_step_max_n_m_per_ms},
      {"return_step_max_n_per_ms",
       "Greatest change of the displayed force in a millisecond in the half second after a silence of more than 110 "
       "ms; null without one.",
       Combine::kGreatest, return_step_max_n_per_ms},
      {"slew_activations", "Ticks in which the slew limit held the force back.", Combine::kSum, of_user<kSlewed>},
      {"silence_max_ms",
       "Longest time without a datagram at the client, or from it at the server. Above 110 ms the force has to fall, "
       "or the server releases the tool: such seeds are evaluated separately.",
       Combine::kGreatest, silence_max_ms},
      {"ghost_contact_ms",
       "Longest time for which more than 0.2 N is displayed where the reference feels less than 0.05 N.",
       Combine::kGreatest, ghost_contact_ms},
      {"force_above_60_hz_n", "RMS of the displayed force above 60 Hz (Butterworth, order 8), phases in contact.",
       Combine::kGreatest, force_above_60_hz_n},
      {"energy_created_max_j",
       "Largest value of E(t), the energy that was created. E is the sum over users of (work done on the hand up to "
       "input k) + (energy put into the world by that user's coupling up to the same input), in world joules. The "
       "wrench is the one after the passivity controller (energy_ledger.hpp).",
       Combine::kGreatest, nullptr, of_ledger<&EnergyLedger::created_max_j>},
      {"energy_created_in_100_ms_j",
       "Greatest rise of E(t) within 0.1 s: earlier dissipation by friction cannot hide it.", Combine::kGreatest,
       nullptr, of_ledger<&EnergyLedger::created_in_100_ms_j>},
      {"energy_created_in_1_s_j", "Greatest rise of E(t) within 1 s.", Combine::kGreatest, nullptr,
       of_ledger<&EnergyLedger::created_in_1_s_j>},
      {"energy_of_late_display_j",
       "Energy that a display would create if it showed every hand of the reference the right wrench one loop late "
       "(one loop: the mean transit time of this trial's inputs plus that of its states, buffering included): the "
       "greatest rise of Σ over users of ∫ [F(t − loop) − F(t)] v dt, in world joules (energy_ledger.hpp).",
       Combine::kGreatest, nullptr, energy_of_late_display_j},
      {"energy_withheld_by_safety_j",
       "Work that start ramp, decay in silence, slew limit and clamp withheld from the hands, in world joules. "
       "Reported separately, because E(t) uses the force before these stages.",
       Combine::kGreatest, nullptr, of_ledger<&EnergyLedger::withheld_by_safety_j>},
      {"hand_port_j", "Work done on the hand over the trial, in world joules; negative if the hand did work.",
       Combine::kSum, hand_port_j},
      {"passivity_dissipated_fraction",
       "Energy that the passivity controller withheld, over the energy that hand and display exchanged in both "
       "directions; null below 20 mJ exchanged.",
       Combine::kGreatest, passivity_dissipated_fraction},
      {"tool_energy_limited_fraction",
       "Share of the trial in which the room limited a tool that would have put more into the world than its user's "
       "hand put in.",
       Combine::kGreatest, tool_energy_limited_fraction},
      {"view_divergence_max_m",
       "Greatest distance between where two users see the watched body at the same instant. It contains the motion of "
       "the body during the difference of their delays.",
       Combine::kGreatest, nullptr, view_divergence_max_m},
      {"datagrams_per_s", "Datagrams of client and server, lost ones too.", Combine::kSum,
       [](const UserView& view) { return per_second(view, view.user.traffic.datagrams); }},
      {"bytes_per_s", "Bytes of datagrams and control in both directions, without headers of UDP, TCP and IP.",
       Combine::kSum, [](const UserView& view) { return per_second(view, view.user.traffic.bytes); }},
  };
  return metrics;
}

UserView view_of_user(const TrialView& trial, std::size_t user) {
  const auto of = [user](const SessionTrace* trace) { return trace != nullptr ? &trace->users[user] : nullptr; };
  return {trial.experiment, trial.trace.users[user], of(trial.reference), of(trial.same_stage)};
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

const TrialMetric& trial_metric_called(std::string_view name) {
  for (const TrialMetric& metric : trial_metrics()) {
    if (metric.name == name) return metric;
  }
  throw std::invalid_argument("metric \"" + std::string(name) + "\" is not known; see lab/metrics/trial_metrics.cpp");
}

double worst_value(const TrialMetric& metric, const std::vector<double>& values) {
  if (metric.combine == Combine::kMean) return kUndefined;
  return combined(metric.combine == Combine::kSum ? Combine::kGreatest : metric.combine, values);
}

double trial_metric(const TrialView& trial, std::string_view name) {
  return value_of(trial_metric_called(name), trial);
}

}  // namespace tandem::lab

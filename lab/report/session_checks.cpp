#include "lab/report/session_checks.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::lab {
namespace {

/// Tolerance for rounding: the decimal text of a trace may exceed the force limit slightly.
constexpr double kTraceRounding = 1e-4;
constexpr double kInPercent = 100;
constexpr double kMillimetres = 1e3;

// Bounds of the checks. They are our choice, for the reason beside each.
// minimum of a felt force; several times the force that the stage late-pose displays to a resting hand
constexpr double kFeltForce_n = 0.3;
// minimum displacement of a moved body; penetration and settling of a contact move a body less
constexpr double kBodyDisplacement_m = 0.002;
// maximum fraction of clamped ticks; above it, the force would be determined by the device's limit and not by the scene
constexpr double kClampedFraction = 0.01;
// maximum speed of a resting hand: above the speed of tremor, and a tenth of the speed in a limit cycle
constexpr double kSettledHandSpeed_m_per_s = 0.020;
constexpr double kTicksRunFraction = 0.99;
constexpr double kTickRate_hz = 1000;
constexpr double kTickRateErrorFraction = 0.01;

const PhaseSummary& hold_phase(const Session& session, const ClientRun& summary) {
  if (const auto* phase = summary.phase(kHoldPhase)) return *phase;
  std::string known;
  for (const PhaseSummary& phase : summary.phases) known += (known.empty() ? "" : ", ") + phase.name;
  throw std::invalid_argument("session " + session.name + ", user " + summary.name +
                              ": phases has no \"hold\" (it has: " + (known.empty() ? "none" : known) +
                              "); give the client a hand path with a phase of that name");
}

double largest_finite(const std::vector<double>& values) {
  double largest = 0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, value);
  }
  return largest;
}

/// Returns the number of samples whose force or torque is not finite. It is at least 1 if the client's summary reports
/// such a value, because the trace may lack the tick at which it occurred.
double not_finite_count(const ClientRun& user) {
  const auto& force = user.trace.force_n;
  const auto& torque = user.trace.torque_n_m;
  std::size_t count = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    if (!std::isfinite(force[i]) || !std::isfinite(torque[i])) ++count;
  }
  if (!user.all_forces_finite) count = std::max<std::size_t>(count, 1);
  return static_cast<double>(count);
}

void add_touch_checks(const std::string& scope, const ClientRun& user, const PhaseSummary& hold,
                      std::vector<Check>& out) {
  out.push_back({scope, "shared body felt: mean force, settled hold phase", hold.settled_force_mean_n,
                 Relation::kAtLeast, kFeltForce_n, "N", 2});
  out.push_back({scope, "shared body moved: largest displacement", user.body_displacement_m * kMillimetres,
                 Relation::kAtLeast, kBodyDisplacement_m * kMillimetres, "mm", 1});
  out.push_back({scope, "hand at rest: largest speed, settled hold phase",
                 hold.settled_hand_speed_max_m_per_s * kMillimetres, Relation::kAtMost,
                 kSettledHandSpeed_m_per_s * kMillimetres, "mm/s", 1});
}

void add_force_checks(const std::string& scope, const ClientRun& user, std::vector<Check>& out) {
  const double largest = std::max(user.force_max_n, largest_finite(user.trace.force_n));
  const double limit = user.force_limit_n;
  out.push_back({scope, "forces that are not finite", not_finite_count(user), Relation::kAtMost, 0, "ticks", 0});
  out.push_back({scope, "largest force, within the device's limit",
                 largest <= limit * (1 + kTraceRounding) ? std::min(largest, limit) : largest, Relation::kAtMost, limit,
                 "N", 2});
  out.push_back({scope, "time at the clamp", user.clamped_fraction * kInPercent, Relation::kBelow,
                 kClampedFraction * kInPercent, "%", 2});
}

void add_timing_checks(const std::string& scope, const ClientRun& summary, std::vector<Check>& out) {
  // If no ticks are expected, 0/0 gives NaN, and the check fails.
  const double run = static_cast<double>(summary.loop.ticks_run) / static_cast<double>(summary.loop.ticks_expected);
  const double error = std::abs(summary.loop.tick_rate_hz / kTickRate_hz - 1);
  out.push_back({scope, "haptic ticks run, of those expected", run * kInPercent, Relation::kAtLeast,
                 kTicksRunFraction * kInPercent, "%", 2});
  out.push_back({scope, "mean tick rate, off 1 kHz by", error * kInPercent, Relation::kAtMost,
                 kTickRateErrorFraction * kInPercent, "%", 2});
}

}  // namespace

std::vector<Check> check_sessions(std::span<const Session> sessions) {
  std::vector<Check> checks;
  for (const Session& session : sessions) {
    for (const ClientRun& user : session.users) {
      const std::string scope = session.name + " · " + user.name;
      add_touch_checks(scope, user, hold_phase(session, user), checks);
      add_force_checks(scope, user, checks);
      add_timing_checks(scope, user, checks);
    }
  }
  return checks;
}

}  // namespace tandem::lab

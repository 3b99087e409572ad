// Tests every metric on synthetic traces with known values.
#include "lab/metrics/trial_metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

#include "lab/metrics/energy_ledger.hpp"
#include "lab/metrics/felt_mass.hpp"
#include "lab/metrics/outcome.hpp"
#include "lab/metrics/touch_errors.hpp"

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

double sine(double frequency_hz, double time_s) {
  return std::sin(2 * std::numbers::pi * frequency_hz * time_s);
}

devices::WayPoint begin_of(const char* phase, double at_s) {
  devices::WayPoint point;
  point.at = from_seconds(at_s);
  point.phase = phase;
  return point;
}

using Fill = std::function<void(TickSample&, double time_s)>;

/// Returns a trace of one user whose hand has these phases. `fill` sets the values of each tick.
SessionTrace trace_of(const std::vector<devices::WayPoint>& phases, double duration_s, const Fill& fill) {
  SessionTrace trace;
  UserTrace& user = trace.users.emplace_back();
  user.user.name = "anna";
  user.user.hand = devices::HandPath(phases);
  for (int k = 0; k < static_cast<int>(std::lround(duration_s * 1000)); ++k) {
    TickSample tick;
    tick.time = milliseconds(k);
    tick.phase = user.user.hand.phase_at(tick.time);
    fill(tick, k / 1000.0);
    user.ticks.push_back(tick);
  }
  return trace;
}

/// Returns a trace with 1 s of "move", 3 s of "contact" and 3 s of "hold".
SessionTrace pressing(const Fill& fill) {
  return trace_of({begin_of("move", 0), begin_of("contact", 1), begin_of("hold", 4)}, 7, fill);
}

double metric(const char* name, const SessionTrace& trace, const SessionTrace* reference = nullptr) {
  static const Experiment experiment;
  return trial_metric({experiment, trace, reference}, name);
}

void force(TickSample& tick, double z_n) {
  tick.displayed_D.f = tick.requested_D.f = tick.stage_D.f = Vec3(0, 0, z_n);
}

TEST(TrialMetrics, FreeDragIsTheForceOfMovingBeyondThatAtZeroDelay) {
  const SessionTrace trace = pressing([](TickSample& tick, double t) { force(tick, t < 1 ? 3 : 9); });
  const SessionTrace reference = pressing([](TickSample& tick, double t) { force(tick, t < 1 ? 1 : 5); });
  EXPECT_NEAR(metric("free_drag_rms_n", trace, &reference), 2, 1e-12);
  EXPECT_TRUE(std::isnan(metric("free_drag_rms_n", trace)));
}

TEST(TrialMetrics, ContactPhasesAreThoseInWhichTheHandFeelsSomethingAtZeroDelay) {
  const SessionTrace reference = pressing([](TickSample& tick, double t) { force(tick, t < 4 ? 2 : 0.05); });
  const SessionTrace trace = pressing([](TickSample& tick, double) { force(tick, 4); });
  const Experiment experiment;
  const UserView view{experiment, trace.users[0], &reference.users[0], nullptr};
  EXPECT_EQ(contact_phases(view), (std::vector<bool>{false, true, false}))
      << "the move phase has no contact, and in the last phase it is too weak";
  EXPECT_NEAR(metric("contact_force_mean_n", trace, &reference), 4, 1e-12);
  EXPECT_NEAR(metric("contact_force_ratio", trace, &reference), 2, 1e-12);
}

TEST(TrialMetrics, ContactErrorIsTheRmsDifferenceAtTheSameTime) {
  const SessionTrace reference = pressing([](TickSample& tick, double t) { force(tick, 2 + sine(1, t)); });
  const SessionTrace trace = pressing([](TickSample& tick, double t) {
    force(tick, 2 + sine(1, t));
    if (t >= 1) tick.displayed_D.f.x() = 0.3 * sine(2, t);
  });
  EXPECT_NEAR(metric("contact_error_rms_n", trace, &reference), 0.3 / std::sqrt(2.0), 1e-9);
  EXPECT_EQ(metric("contact_error_rms_n", reference, &reference), 0);
  EXPECT_NEAR(metric("contact_error_fraction", trace, &reference), 0.3 / std::sqrt(2.0) / 2, 1e-9);
  // The force is 2 N + 1 N · sin(2π f t) with f = 1 Hz, but late by T = 20 ms. Its error is a sine with the amplitude 2
  // sin(π f T) N.
  const SessionTrace late = pressing([](TickSample& tick, double t) { force(tick, 2 + sine(1, t - 0.020)); });
  EXPECT_NEAR(metric("contact_error_rms_n", late, &reference), 2 * std::sin(std::numbers::pi * 0.020) / std::sqrt(2.0),
              1e-6);
}

TEST(TrialMetrics, FeltStiffnessIsTheRatioOfSlopes) {
  const auto spring = [](double n_per_m) {
    return pressing([n_per_m](TickSample& tick, double t) {
      const double depth = 0.005 + 0.004 * sine(0.5, t);
      tick.hand_D.p = Vec3(0.1, 0, -depth);
      force(tick, n_per_m * depth);
    });
  };
  const SessionTrace reference = spring(500);
  EXPECT_NEAR(metric("felt_stiffness_ratio", spring(350), &reference), 0.7, 1e-9);
  const SessionTrace constant = pressing([](TickSample& tick, double) { force(tick, 2); });
  EXPECT_TRUE(std::isnan(metric("felt_stiffness_ratio", constant, &constant))) << "the penetration was constant";
  // A force that does not depend on the position of the hand gives no stiffness.
  const SessionTrace sliding = pressing([](TickSample& tick, double t) {
    tick.hand_D.p = Vec3(0, 0, 0.004 * sine(0.5, t));
    force(tick, 2 + sine(0.5, t + 0.5));
  });
  EXPECT_TRUE(std::isnan(metric("felt_stiffness_ratio", sliding, &sliding)));
}

/// Returns a trace of a hand that shakes `mass_kg` on a damper and a spring along x, at 0.5–5 Hz.
SessionTrace shaking(double mass_kg, double noise_n = 0) {
  return trace_of({begin_of("move", 0), begin_of("shake", 1), begin_of("hold", 10)}, 11,
                  [=](TickSample& tick, double t) {
                    double x = 0;
                    double v = 0;
                    double a = 0;
                    for (const double hz : {0.5, 1.25, 2.5, 5.0}) {
                      const double w = 2 * std::numbers::pi * hz;
                      x += 0.03 / w * std::sin(w * t + hz);
                      v += 0.03 * std::cos(w * t + hz);
                      a -= 0.03 * w * std::sin(w * t + hz);
                    }
                    tick.hand_D.p = Vec3(0.2 + x, 0, 0.1);
                    tick.hand_twist_D.v = Vec3(v, 0, 0);
                    // The force of a tick is held for 1 ms. Therefore the force at the time of a tick is the mean of
                    // the forces held before and after it.
                    tick.displayed_D.f = Vec3(-(mass_kg * a + 0.5 * v + 20 * x) + noise_n * sine(17, t), 0, -2);
                  });
}

TEST(FeltMass, IsTheShakenMassForAnySpringAndDamper) {
  const FeltMass felt = felt_mass(shaking(0.2).users[0]);
  EXPECT_NEAR(felt.mass_kg, 0.2, 0.002) << "half a millisecond between force and movement";
  EXPECT_LT(felt.half_width_kg, 0.002);
  const FeltMass noisy = felt_mass(shaking(0.2, 0.05).users[0]);
  EXPECT_NEAR(noisy.mass_kg, 0.2, noisy.half_width_kg + 0.002);
  EXPECT_GT(noisy.half_width_kg, felt.half_width_kg);
}

TEST(FeltMass, IsUnknownWithoutShaking) {
  EXPECT_TRUE(std::isnan(felt_mass(pressing([](TickSample&, double) {}).users[0]).mass_kg));
  const SessionTrace still =
      trace_of({begin_of("shake", 0)}, 6, [](TickSample& tick, double t) { force(tick, sine(3, t)); });
  EXPECT_TRUE(std::isnan(felt_mass(still.users[0]).mass_kg));
}

TEST(TrialMetrics, FeltMassIsHeldAgainstZeroDelay) {
  const SessionTrace reference = shaking(0.2);
  const SessionTrace trace = shaking(0.25);
  EXPECT_NEAR(metric("felt_mass_ratio", trace, &reference), 1.25, 0.01);
  EXPECT_LT(metric("felt_mass_interval_fraction", trace, &reference), 0.01);
}

TEST(TrialMetrics, TheLimitCycleIsTheSpeedOfAHandThatShouldRest) {
  const SessionTrace trace = pressing([](TickSample& tick, double t) {
    tick.hand_twist_D.v.y() = t < 5 ? 1 : 0.004 * sine(5, t);  // the hand settles in the first second of the hold
  });
  EXPECT_NEAR(metric("limit_cycle_m_per_s", trace), 0.004 / std::sqrt(2.0), 1e-9);
}

TEST(TrialMetrics, PeakAndStepOfTheForce) {
  const SessionTrace reference = pressing([](TickSample& tick, double t) { force(tick, t < 2 ? 0 : 0.4); });
  const SessionTrace trace = pressing([](TickSample& tick, double t) {
    force(tick, t < 2 ? 0 : 0.4);
    if (t >= 3) tick.stage_D.f.x() = 1.5;
    tick.displayed_D.f.x() = t >= 3 ? std::min(1.5, 100 * (t - 3)) : 0;  // limited by the slew limit
    if (t >= 3 && t < 3.0145) tick.safety_faults = haptics::kSafetySlewed;
  });
  EXPECT_NEAR(metric("peak_force_n", trace, &reference), std::hypot(0.4, 1.5), 1e-9);
  EXPECT_NEAR(metric("force_step_max_n_per_ms", trace, &reference), 1.5, 1e-9) << "a step elsewhere excuses none";
  EXPECT_EQ(metric("force_step_max_n_per_ms", reference, &trace), 0) << "less than at zero delay is no excess";
  EXPECT_EQ(metric("slew_activations", trace, &reference), 15);
}

/// Returns a trace with a step of 0.5 N and 0.05 N·m at `at_s`.
SessionTrace stepping(double at_s) {
  return pressing([at_s](TickSample& tick, double t) {
    if (t >= at_s) tick.stage_D = {Vec3(0.5, 0, 0), Vec3(0, 0.05, 0)};
  });
}

TEST(TrialMetrics, AStepIsExcusedByOneOfTheReferenceATenthOfASecondAndARoundTripAway) {
  const SessionTrace reference = stepping(3);
  for (const double apart_s : {-0.1, 0.0, 0.1}) {
    EXPECT_EQ(metric("force_step_max_n_per_ms", stepping(3 + apart_s), &reference), 0) << apart_s;
    EXPECT_EQ(metric("torque_step_max_n_m_per_ms", stepping(3 + apart_s), &reference), 0) << apart_s;
  }
  EXPECT_NEAR(metric("force_step_max_n_per_ms", stepping(3.102), &reference), 0.5, 1e-12);
  EXPECT_NEAR(metric("torque_step_max_n_m_per_ms", stepping(2.898), &reference), 0.05, 1e-12);
  SessionTrace late = stepping(3.199);
  late.users[0].user.up.delay = late.users[0].user.down.delay = milliseconds(50);
  EXPECT_EQ(metric("force_step_max_n_per_ms", late, &reference), 0)
      << "the step is within the delay of a partner's contact";
}

TEST(TrialMetrics, AReturnIsHalfASecondAfterALongSilence) {
  const auto trace = [](double silence_s, double step_at_s) {
    return pressing([=](TickSample& tick, double t) {
      tick.state_age = from_seconds(t >= 2 && t - 2 <= silence_s ? t - 2 : 0.005);
      force(tick, t >= step_at_s ? 0.4 : 0);
    });
  };
  EXPECT_TRUE(std::isnan(metric("return_step_max_n_per_ms", trace(0.1, 2.2))));
  EXPECT_NEAR(metric("return_step_max_n_per_ms", trace(0.15, 2.2)), 0.4, 1e-12);
  for (const double outside_s : {2.7, 2.1}) EXPECT_EQ(metric("return_step_max_n_per_ms", trace(0.15, outside_s)), 0);
}

TEST(TrialMetrics, PathErrorsAreOfTheWholePathAndOverThePeak) {
  const SessionTrace reference = pressing([](TickSample& tick, double t) {
    force(tick, t < 1 ? 0 : 2);
    tick.displayed_D.t.y() = t < 1 ? 0 : 0.02;
  });
  // The trace differs from the reference only in the first of its seven seconds, in the phase "move". Metrics of
  // contact must not count this difference; metrics of the whole path must.
  const SessionTrace trace = pressing([](TickSample& tick, double t) {
    force(tick, t < 1 ? 1 : 2);
    tick.displayed_D.t.y() = t < 1 ? 0.01 : 0.02;
  });
  EXPECT_EQ(metric("contact_error_rms_n", trace, &reference), 0);
  EXPECT_NEAR(metric("path_error_rms_n", trace, &reference), std::sqrt(1.0 / 7), 1e-9);
  EXPECT_NEAR(metric("path_error_of_peak", trace, &reference), std::sqrt(1.0 / 7) / 2, 1e-9);
  EXPECT_NEAR(metric("path_torque_error_rms_n_m", trace, &reference), 0.01 * std::sqrt(1.0 / 7), 1e-12);
  EXPECT_NEAR(metric("path_torque_error_of_peak", trace, &reference), 0.5 * std::sqrt(1.0 / 7), 1e-9);
  const SessionTrace nothing = pressing([](TickSample&, double) {});
  EXPECT_TRUE(std::isnan(metric("path_error_of_peak", trace, &nothing)));
  EXPECT_TRUE(std::isnan(metric("path_torque_error_of_peak", trace, &nothing)));
}

TEST(TrialMetrics, TheEffectOfDelayIsComparedWithTheSameStage) {
  const SessionTrace reference = pressing([](TickSample& tick, double) { force(tick, 4); });
  const SessionTrace same_stage = pressing([](TickSample& tick, double) { force(tick, 3); });
  const SessionTrace trace = pressing([](TickSample& tick, double) { force(tick, 3.25); });
  const Experiment experiment;
  const TrialView view{experiment, trace, &reference, &same_stage};
  EXPECT_NEAR(trial_metric(view, "contact_error_rms_n"), 0.75, 1e-12);
  EXPECT_NEAR(trial_metric(view, "contact_delay_error_rms_n"), 0.25, 1e-12);
}

TEST(TrialMetrics, TheHoldIsJudgedByItsMeanAndItsLeast) {
  const SessionTrace reference = pressing([](TickSample& tick, double) { force(tick, 4); });
  const SessionTrace trace = pressing([](TickSample& tick, double t) { force(tick, t < 5 ? 0 : (t < 6 ? 3 : 5)); });
  EXPECT_NEAR(metric("hold_force_ratio", trace, &reference), 1, 1e-9) << "its first second does not count";
  EXPECT_NEAR(metric("hold_force_least_ratio", trace, &reference), 0.75, 1e-12);
}

TEST(TrialMetrics, AHandThatShouldRestMayNotTurn) {
  const SessionTrace trace = pressing([](TickSample& tick, double t) { tick.hand_twist_D.w.z() = t < 5 ? 1 : 0.02; });
  EXPECT_NEAR(metric("limit_cycle_rad_per_s", trace), 0.02, 1e-12);
}

TEST(TrialMetrics, ASilenceIsAsLongAsTheOldestState) {
  const SessionTrace trace = pressing(
      [](TickSample& tick, double t) { tick.state_age = t < 2 || t > 2.12 ? milliseconds(1) : from_seconds(t - 2); });
  EXPECT_NEAR(metric("silence_max_ms", trace), 120, 1e-6);
}

TEST(TrialMetrics, GhostContactIsFeltWhereThereIsNothing) {
  const SessionTrace reference = pressing([](TickSample& tick, double t) { force(tick, t < 3 ? 2 : 0); });
  const SessionTrace trace = pressing([](TickSample& tick, double t) { force(tick, t < 3.05 ? 2 : 0); });
  EXPECT_NEAR(metric("ghost_contact_ms", trace, &reference), 50, 1e-9);
  EXPECT_EQ(metric("ghost_contact_ms", reference, &reference), 0);
}

TEST(TrialMetrics, TheSpectrumAbove60HzContainsFastChangesOnly) {
  const auto shaken = [](double hz) {
    return pressing([hz](TickSample& tick, double t) { force(tick, 2 + 0.1 * sine(hz, t)); });
  };
  EXPECT_NEAR(metric("force_above_60_hz_n", shaken(120)), 0.1 / std::sqrt(2.0), 2e-3);
  EXPECT_LT(metric("force_above_60_hz_n", shaken(20)), 1e-3);
}

/// Returns a trace of a hand that moves at 0.1 m/s for 1 s against a constant force. The world gains `world_gain_j` in
/// total from the inputs of the hand, each of which is used `late_ms` after it was sent.
SessionTrace working(double force_n, double world_gain_j, int late_ms = 0) {
  SessionTrace trace = trace_of({begin_of("contact", 0)}, 1.001, [=](TickSample& tick, double t) {
    tick.tick = Tick{static_cast<std::uint64_t>(std::lround(1000 * t)) + 77};
    tick.hand_D.p.z() = 0.1 * t;
    force(tick, force_n);
  });
  for (int k = 0; k <= 1000; ++k) {
    const auto tick = Tick{static_cast<std::uint64_t>(k) + 77};
    trace.users[0].answered.push_back({milliseconds(k + late_ms), tick, 3 + world_gain_j * k / 1000.0});
  }
  return trace;
}

TEST(EnergyLedger, EnergyFromTheWorldIsNotCreatedAtAnyInputDelay) {
  for (const int late_ms : {0, 300}) {
    const EnergyLedger ledger = energy_ledger(working(2, -0.2, late_ms));
    EXPECT_NEAR(ledger.hand_ports_j.at(0), 0.2, 1e-9);
    EXPECT_NEAR(ledger.created_max_j, 0, 1e-9);
    EXPECT_NEAR(ledger.created_in_100_ms_j, 0, 1e-9);
    EXPECT_EQ(energy_ledger(working(-2, 0.1, late_ms)).created_max_j, 0)
        << "half of the supplied energy was dissipated";
  }
}

TEST(EnergyLedger, TheGreatestSurplusAtAnyTimeCounts) {
  EXPECT_NEAR(energy_ledger(working(2, 0.1)).created_max_j, 0.3, 1e-9);
  EXPECT_NEAR(metric("energy_created_max_j", working(2, 0.1)), 0.3, 1e-9);
  SessionTrace later = working(2, -0.2);
  std::vector<AnsweredInput>& answered = later.users[0].answered;
  answered.back().taken_j -= 5;  // the energy is removed again at the end
  for (std::size_t k = 400; k < 600; ++k) answered[k].taken_j += 0.05;
  EXPECT_NEAR(energy_ledger(later).created_max_j, 0.05, 1e-9);
}

TEST(EnergyLedger, AShortRiseIsDetectedWhateverWasDissipatedBefore) {
  // The first half second dissipates energy at 1 W; then energy is created at 0.4 W. The rise within 100 ms must be
  // 0.04 J. Fails if the earlier dissipation is offset against the later creation.
  SessionTrace trace = working(0, 0);
  for (std::size_t k = 0; k <= 1000; ++k) {
    const double t = static_cast<double>(k) / 1000;
    trace.users[0].answered[k].taken_j = t < 0.5 ? 3 - t : 2.5 + 0.4 * (t - 0.5);
  }
  const EnergyLedger ledger = energy_ledger(trace);
  EXPECT_EQ(ledger.created_max_j, 0);
  EXPECT_NEAR(ledger.created_in_100_ms_j, 0.04, 1e-9);
  EXPECT_NEAR(ledger.created_in_1_s_j, 0.2, 1e-9);
}

TEST(EnergyLedger, EnergySuppliedByOneUserMayReachAnother) {
  SessionTrace trace = working(2, 0);  // the hand receives 0.2 J that its coupling at the server does not supply
  trace.users.push_back(working(-2, 0).users[0]);
  EXPECT_NEAR(energy_ledger(trace).created_max_j, 0, 1e-9);
  trace.users[1] = working(-1.5, 0).users[0];
  EXPECT_NEAR(energy_ledger(trace).created_max_j, 0.05, 1e-9);
}

TEST(EnergyLedger, ADelayedSpringCreatesTheEnergyThatTheoryPredicts) {
  // A hand oscillates with 5 mm at 5 Hz on a spring of 500 N/m at the server. The response is displayed late.
  constexpr double kSpring = 500, kSwing_m = 0.005;
  const auto at = [](double t) { return kSwing_m * sine(5, std::max(0.0, t)); };
  for (const int late_ms : {4, 20, 40}) {
    SessionTrace trace = trace_of({begin_of("contact", 0)}, 1.001, [=](TickSample& tick, double t) {
      tick.tick = Tick{static_cast<std::uint64_t>(std::lround(1000 * t)) + 77};
      tick.hand_D.p.z() = at(t);
      force(tick, -kSpring * at(t - late_ms * 1e-3));
    });
    for (int k = 0; k <= 1000; ++k) {
      const double z = at(k * 1e-3);
      const auto tick = Tick{static_cast<std::uint64_t>(k) + 77};
      trace.users[0].answered.push_back({milliseconds(k + late_ms / 2), tick, 0.5 * kSpring * z * z});
    }
    // Theory: a spring whose force is late creates the energy π k A² sin(ωT) in each period of the hand's oscillation.
    // * k: stiffness of the spring; T: lateness
    // * A, ω: amplitude and angular frequency of the hand
    //
    // The trace of 1 s has five periods.
    const double theory_j = 5 * std::numbers::pi * kSpring * kSwing_m * kSwing_m * sine(5, late_ms * 1e-3);
    EXPECT_NEAR(energy_ledger(trace).created_max_j, theory_j, 0.1 * theory_j + 0.01) << late_ms;
  }
}

TEST(TrialMetrics, ToolEnergyLimitedIsTheShareOfTicksThatSaySo) {
  SessionTrace trace = pressing([](TickSample& tick, double t) {
    tick.server_tick_faults = t < 0.7 ? kFaultToolEnergyLimited | kFaultFieldLimited : kFaultFieldLimited;
  });
  EXPECT_NEAR(metric("tool_energy_limited_fraction", trace), 0.1, 1e-12);
}

TEST(EnergyLedger, CountsInWorldJoulesAndKeepsApartWhatSafetyWithheld) {
  SessionTrace trace = working(2, 0);
  trace.users[0].hand_joules_per_world_joule = 4;
  EXPECT_NEAR(energy_ledger(trace).hand_ports_j.at(0), 0.05, 1e-9);
  SessionTrace clamped = working(2, -0.5);
  for (TickSample& tick : clamped.users[0].ticks) tick.requested_D.f.z() = 5;
  EXPECT_NEAR(energy_ledger(clamped).created_max_j, 0, 1e-9) << "the model had it";
  EXPECT_NEAR(energy_ledger(clamped).hand_ports_j.at(0), 0.2, 1e-9) << "the hand did not get it";
  EXPECT_NEAR(metric("energy_withheld_by_safety_j", clamped), 0.3, 1e-9);
}

TEST(TrialMetrics, ThePassivityControllersShareNeedsAnExchange) {
  SessionTrace trace = pressing([](TickSample&, double) {});
  UserTrace& user = trace.users[0];
  user.energy_to_hand_j = 0.03;
  user.energy_from_hand_j = 0.05;
  user.passivity_dissipated_j = 0.004;
  EXPECT_NEAR(metric("passivity_dissipated_fraction", trace), 0.05, 1e-12);
  EXPECT_NEAR(metric("hand_port_j", trace), -0.02, 1e-12);
  user.energy_from_hand_j = -0.03 + 0.019;
  EXPECT_TRUE(std::isnan(metric("passivity_dissipated_fraction", trace))) << "19 mJ";
}

TEST(TrialMetrics, ViewsThatArriveApartDivergeByTheMovementBetween) {
  SessionTrace trace = pressing([](TickSample& tick, double t) {
    tick.view_W.x() = 0.2 * t;
    tick.has_view = t > 0.5;
  });
  EXPECT_TRUE(std::isnan(metric("view_divergence_max_m", trace))) << "one user sees no difference";
  trace.users.push_back(trace.users[0]);
  EXPECT_NEAR(metric("view_divergence_max_m", trace), 0, 1e-12);
  for (TickSample& tick : trace.users[1].ticks) tick.view_W.x() -= 0.2 * 0.050;
  EXPECT_NEAR(metric("view_divergence_max_m", trace), 0.010, 1e-9);
  // The second user now sees the same motion, but its samples are taken 0.5 ms later than those of the first user. The
  // metric must interpolate to equal times, so the difference between the users must not change.
  SessionTrace shifted = trace;
  for (TickSample& tick : shifted.users[1].ticks) {
    tick.view_W.x() += 0.2 * 0.0505;
    tick.time += std::chrono::microseconds(500);
  }
  EXPECT_NEAR(metric("view_divergence_max_m", shifted), 0, 1e-9);
}

TEST(TrialMetrics, TrafficIsPerSecondAndOfAllUsers) {
  Experiment experiment;
  experiment.duration = seconds(7);
  SessionTrace trace = pressing([](TickSample&, double) {});
  trace.users[0].traffic = {14000, 700000};
  trace.users.push_back(trace.users[0]);
  EXPECT_NEAR(trial_metric({experiment, trace}, "datagrams_per_s"), 4000, 1e-9);
  EXPECT_NEAR(trial_metric({experiment, trace}, "bytes_per_s"), 200000, 1e-9);
}

TEST(TrialMetrics, TakeTheWorstUserWhereThatIsTheQuestion) {
  const SessionTrace reference = [] {
    SessionTrace both = pressing([](TickSample& tick, double) { force(tick, 4); });
    both.users.push_back(both.users[0]);
    return both;
  }();
  SessionTrace trace = reference;
  for (TickSample& tick : trace.users[1].ticks) force(tick, 3);
  EXPECT_NEAR(metric("contact_force_ratio", trace, &reference), 0.75, 1e-12);
  EXPECT_NEAR(metric("contact_force_mean_n", trace, &reference), 3.5, 1e-12);
  EXPECT_NEAR(metric("contact_error_rms_n", trace, &reference), 1, 1e-12);
}

TEST(TrialMetrics, HaveNoValueInAnEmptyTraceAndNamesOfTheirOwn) {
  SessionTrace trace;
  trace.users.emplace_back();
  for (const TrialMetric& each : trial_metrics()) {
    const double value = metric(each.name.data(), trace);
    EXPECT_TRUE(std::isnan(value) || value == 0) << each.name << " is " << value;
    EXPECT_FALSE(each.definition.empty()) << each.name;
    EXPECT_NE(each.of_user == nullptr, each.of_trial == nullptr) << each.name;
  }
  EXPECT_THROW(metric("happiness", trace), std::invalid_argument);
}

/// Returns the outcome for a cube with these heights, one per second. The hand holds it from 2 s to 4 s.
std::string outcome_with(const std::vector<double>& heights_m) {
  Experiment experiment;
  experiment.outcome = {"cube", 0.05, "carry"};
  SessionTrace trace =
      trace_of({begin_of("approach", 0), begin_of("carry", 2), begin_of("retreat", 5)}, 7, [](TickSample&, double) {});
  trace.body_names = {"table", "cube"};
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    BodiesSample sample;
    sample.time = seconds(i);
    sample.X_WB.resize(2);
    sample.X_WB[1].p.z() = 0.02 + heights_m[i];
    trace.bodies.push_back(sample);
  }
  return outcome_of({experiment, trace});
}

TEST(Outcome, StatesWhetherTheBodyWasCarriedAllTheWay) {
  EXPECT_EQ(outcome_with({0, 0.06, 0.06, 0.10, 0.06, 0, 0}), "completed") << "it may be set down afterwards";
  EXPECT_EQ(outcome_with({0, 0.06, 0.06, 0.04, 0.06, 0, 0}), "dropped");
  EXPECT_EQ(outcome_with({0, 0.04, 0.04, 0.04, 0.04, 0, 0}), "never-lifted");
}

TEST(Outcome, StatesWhetherTheBodyEndsAtItsTarget) {
  const auto outcome_at = [](const Vec3& first, const Vec3& last) {
    Experiment experiment;
    experiment.outcome = OutcomeRule{"peg", 0, "", Vec3(0.06, 0, 0.03), 0.002};
    SessionTrace trace = pressing([](TickSample&, double) {});
    trace.body_names = {"table", "peg"};
    for (const Vec3& p : {first, last}) {
      BodiesSample sample;
      sample.X_WB.resize(2);
      sample.X_WB[1].p = p;
      trace.bodies.push_back(sample);
    }
    return outcome_of({experiment, trace});
  };
  EXPECT_EQ(outcome_at({0, 0, 0}, {0.061, 0.001, 0.031}), "completed");
  EXPECT_EQ(outcome_at({0, 0, 0}, {0.06, 0, 0.0325}), "missed");
  EXPECT_EQ(outcome_at({0.06, 0, 0.03}, {0, 0, 0}), "missed") << "the body started at the target and left it";
}

TEST(Outcome, OfAHandThatFeelsLessThanHalfOfTheTruthIsWeak) {
  const Experiment experiment;
  const SessionTrace reference = pressing([](TickSample& tick, double) { force(tick, 4); });
  const auto outcome_of_force = [&](double n) {
    const SessionTrace trace = pressing([n](TickSample& tick, double) { force(tick, n); });
    return outcome_of({experiment, trace, &reference});
  };
  EXPECT_EQ(outcome_of_force(2.1), "completed");
  EXPECT_EQ(outcome_of_force(1.9), "weak");
  EXPECT_EQ(outcome_of_force(0), "weak") << "the calmest of all";
}

TEST(Outcome, AUserWhoLostItsConnectionComesFirst) {
  const Experiment experiment;
  SessionTrace trace = pressing([](TickSample&, double) {});
  EXPECT_EQ(outcome_of({experiment, trace}), "completed");
  trace.users[0].stayed_connected = false;
  EXPECT_EQ(outcome_of({experiment, trace}), "lost");
}

}  // namespace
}  // namespace tandem::lab

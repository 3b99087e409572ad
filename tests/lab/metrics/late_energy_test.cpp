// Tests the metric of the energy that a display creates if its force is correct but late.
#include <gtest/gtest.h>

#include "lab/metrics/energy_ledger.hpp"

namespace tandem::lab {
namespace {

using std::chrono::milliseconds;

/// Returns the trace of a hand that moves at 0.1 m/s for 1 s. The force begins at `from`. The server uses each input
/// `input_late` after it was sent, and its states have the age `state_age`.
SessionTrace moving(double force_n, milliseconds from, milliseconds input_late = {}, milliseconds state_age = {}) {
  SessionTrace trace;
  UserTrace& user = trace.users.emplace_back();
  for (int k = 0; k <= 1000; ++k) {
    TickSample& tick = user.ticks.emplace_back();
    tick.tick = Tick{static_cast<std::uint64_t>(k) + 77};
    tick.time = milliseconds(k);
    tick.hand_D.p.z() = 1e-4 * k;
    tick.displayed_D.f.z() = tick.time < from ? 0 : force_n;
    tick.state_age = state_age;
    user.answered.push_back({tick.time + input_late, tick.tick, 0});
  }
  return trace;
}

TEST(LateEnergy, OfAForceThatBeginsALoopLateIsForceTimesSpeedTimesLoop) {
  const SessionTrace truth = moving(-2, milliseconds(500));
  EXPECT_NEAR(late_energy_j(truth, moving(0, {}, milliseconds(60), milliseconds(40))), 2 * 0.1 * 0.1, 1e-9);
  EXPECT_NEAR(late_energy_j(truth, moving(0, {})), 0, 1e-12) << "not late";
  EXPECT_NEAR(late_energy_j(moving(2, milliseconds(500)), moving(0, {}, milliseconds(60))), 0, 1e-12)
      << "the late force dissipates energy";
}

}  // namespace
}  // namespace tandem::lab

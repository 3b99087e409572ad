// Claims about intervals in which no data arrives.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {

/// Checks the displayed force around loss bursts. If no state has arrived for 60 ms, the force must decay to zero,
/// because the server may have failed. When states arrive again, the force must return over the start ramp. Loss bursts
/// of this link last 60 ms on average and occur every few seconds, so that some are long enough.
inline void expect_recovery_from_bursts(bool passivity) {
  const Shown shown("wall", {"link.rtt_ms=100", "link.loss=0.03", "link.bad_period_ms=60",
                             std::string("passivity=") + (passivity ? "true" : "false")});
  const UserTrace& user = shown.trace().users.at(0);
  const UserTrace& whole = shown.reference().users.at(0);
  ASSERT_EQ(user.ticks.size(), whole.ticks.size());
  std::size_t silent = 0;
  double least_share = 1, most_beyond_n = 0, steepest_n = 0;
  for (std::size_t k = 1; k < user.ticks.size(); ++k) {
    const double force_n = user.ticks[k].displayed_D.f.norm();
    const double whole_n = whole.ticks[k].displayed_D.f.norm();
    most_beyond_n = std::max(most_beyond_n, force_n - whole_n);
    steepest_n = std::max(steepest_n, force_n - user.ticks[k - 1].displayed_D.f.norm());
    if ((user.ticks[k].safety_faults & haptics::kSafetySilence) == 0) continue;
    ++silent;
    if (whole_n > 1) least_share = std::min(least_share, force_n / whole_n);
  }
  EXPECT_GT(silent, 20U);
  EXPECT_LT(least_share, 0.9) << "it decays";
  EXPECT_LE(most_beyond_n, 0.5) << "it does not come back as a blow";
  EXPECT_LE(steepest_n, 0.1);
  EXPECT_EQ(shown["slew_activations"], 0);
  EXPECT_GE(shown["contact_force_ratio"], 0.9) << "it comes back";
}

}  // namespace tandem::lab

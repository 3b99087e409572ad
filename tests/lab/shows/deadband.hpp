// Claims about the deadband, which suppresses changes too small to be perceived.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/lab/shows/shown.hpp"

namespace tandem::lab {

inline void expect_few_datagrams(const std::string& experiment) {
  const Shown all(experiment, {"link.rtt_ms=100"});
  const Shown few(experiment, {"link.rtt_ms=100", "deadband=0.1"});
  EXPECT_LE(few["datagrams_per_s"], 0.15 * all["datagrams_per_s"]);
  EXPECT_LE(few["contact_error_fraction"], 0.10);
  EXPECT_EQ(few.outcome(), "completed");
}

inline void expect_no_divergence(const std::string& experiment) {
  const Shown lossy(experiment, {"link.rtt_ms=100", "deadband=0.1", "link.loss=0.1"});
  EXPECT_LE(lossy["limit_cycle_m_per_s"], 0.001);
  EXPECT_LE(lossy["contact_error_fraction"], 0.15);
  EXPECT_EQ(lossy.outcome(), "completed");
}

}  // namespace tandem::lab

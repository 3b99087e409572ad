// Requirement for every reproduction: all its claims hold, and its output contains all of them.
#pragma once

#include <gtest/gtest.h>

#include "lab/results/reproduction.hpp"

namespace tandem::lab {

inline void expect_claims(const Reproduction& reproduction) {
  EXPECT_FALSE(reproduction.claims.empty());
  EXPECT_FALSE(reproduction.figures.empty());
  EXPECT_FALSE(reproduction.summary.empty());
  for (const Check& claim : reproduction.claims) {
    EXPECT_TRUE(claim.holds()) << claim.scope << ": " << claim.claim << " is " << claim.value_text() << ", must be "
                               << claim.bound_text();
  }
  const boost::json::object json = to_json(reproduction);
  EXPECT_EQ(json.at("claims").as_array().size(), reproduction.claims.size());
  EXPECT_EQ(json.at("rows").as_array().size(), reproduction.rows.size());
  EXPECT_FALSE(json.at("details").at("settings").as_object().empty());
}

}  // namespace tandem::lab

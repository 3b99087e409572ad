// The two comparisons of laws that take seconds.
#include <gtest/gtest.h>

#include "lab/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

void expect_claims(const Reproduction& reproduction) {
  EXPECT_FALSE(reproduction.claims.empty());
  for (const report::Check& claim : reproduction.claims) {
    EXPECT_TRUE(claim.holds()) << claim.scope << ": " << claim.claim << " is " << claim.value_text() << ", must be "
                               << claim.bound_text();
  }
}

TEST(ReproduceLaws, TheDefaultBuzzesLeastInALightTouch) {
  expect_claims(reproduce_buzz(SteadyClock{}));
}

TEST(ReproduceLaws, TheLargestStableStiffnessIsAsPredicted) {
  expect_claims(reproduce_zwidth(SteadyClock{}));
}

}  // namespace
}  // namespace tandem::lab

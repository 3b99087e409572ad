// Tests the two comparisons of laws that take several seconds.
#include <gtest/gtest.h>

#include "lab/studies/rendering/reproduce_laws.hpp"
#include "tests/lab/studies/rendering/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproduceLaws, TheDefaultBuzzesLeastInALightTouch) {
  expect_claims(reproduce_buzz(SteadyClock{}));
}

TEST(ReproduceLaws, TheLargestStableStiffnessIsAsPredicted) {
  expect_claims(reproduce_zwidth(SteadyClock{}));
}

}  // namespace
}  // namespace tandem::lab

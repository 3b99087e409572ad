#include <gtest/gtest.h>

#include "lab/prediction/reproduce_prediction.hpp"
#include "tests/lab/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproducePrediction, TheDefaultIsNeverWorseThanHoldAndLinearAndBeatsLinearOnChatter) {
  // A clock that stands still: what a fit costs is not for a test.
  expect_claims(reproduce_prediction(VirtualClock{}));
}

}  // namespace
}  // namespace tandem::lab

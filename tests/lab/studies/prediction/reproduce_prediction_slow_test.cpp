#include <gtest/gtest.h>

#include "lab/studies/prediction/reproduce_prediction.hpp"
#include "tests/lab/studies/rendering/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproducePrediction, TheDefaultIsNeverWorseThanHoldAndLinearAndBeatsLinearOnChatter) {
  // A clock that stands still, because a test does not measure the cost of a fit.
  expect_claims(reproduce_prediction(VirtualClock{}));
}

}  // namespace
}  // namespace tandem::lab

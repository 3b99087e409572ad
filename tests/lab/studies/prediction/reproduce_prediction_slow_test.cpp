#include <gtest/gtest.h>

#include "lab/studies/prediction/reproduce_prediction.hpp"
#include "tests/lab/studies/rendering/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproducePrediction, TheDefaultIsNeverWorseThanHoldAndLinearAndBeatsLinearOnChatter) {
  // The clock does not advance, because a test does not measure the time of a fit.
  expect_claims(reproduce_prediction(VirtualClock{}));
}

}  // namespace
}  // namespace tandem::lab

#include <gtest/gtest.h>

#include "lab/studies/prediction/reproduce_prediction.hpp"
#include "tests/lab/studies/rendering/expect_claims.hpp"

namespace tandem::lab {
namespace {

TEST(ReproducePrediction, TheDefaultIsNeverWorseThanHoldAndLinearAndBeatsLinearOnChatter) {
  // The virtual clock does not advance: a test must not depend on the duration of a fit.
  expect_claims(reproduce_prediction(VirtualClock{}));
}

}  // namespace
}  // namespace tandem::lab

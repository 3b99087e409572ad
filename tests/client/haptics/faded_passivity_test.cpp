// Tests switching the passivity controller: the output wrench while it is off, on, and during the fade between both.
#include "client/haptics/faded_passivity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

constexpr double kPeriod_s = 0.001;
const Wrench kPush{Vec3(2, 0, 0), Vec3::Zero()};

/// A hand that the wrench pushes at 0.1 m/s. It receives energy that no source supplies, so the controller must reduce
/// the wrench.
class PushedHand {
 public:
  Wrench tick(FadedPassivity& passivity) {
    X_WH_.p.x() += 0.1 * kPeriod_s;
    const Wrench passed = passivity.apply(&X_WH_, kPush, 0, kPeriod_s);
    passivity.set_displayed(passed);
    return passed;
  }

 private:
  Pose X_WH_;
};

TEST(FadedPassivity, WithoutAnAccountTheWrenchPassesUnchanged) {
  FadedPassivity passivity(false, false);
  PushedHand hand;
  for (int i = 0; i < 500; ++i) ASSERT_EQ(hand.tick(passivity).f, kPush.f);
  EXPECT_EQ(passivity.apply(nullptr, kPush, 0, kPeriod_s).f, kPush.f);
  EXPECT_EQ(passivity.gain(), 1);
}

TEST(FadedPassivity, OnFromTheStartItReducesTheWrenchOfNoSource) {
  FadedPassivity passivity(true, false);
  PushedHand hand;
  for (int i = 0; i < 500; ++i) hand.tick(passivity);
  EXPECT_LT(hand.tick(passivity).f.x(), 0.2);
  EXPECT_GT(passivity.controller().withheld_j(), 0.05);
}

TEST(FadedPassivity, WithAnEnergyAccountALostHandGetsNothing) {
  FadedPassivity passivity(false, true);
  EXPECT_TRUE(passivity.apply(nullptr, kPush, 0, kPeriod_s).f.isZero(0));
}

TEST(FadedPassivity, SwitchingItChangesTheWrenchWithoutAStep) {
  FadedPassivity passivity(false, true);
  PushedHand hand;
  for (int i = 0; i < 500; ++i) hand.tick(passivity);
  double before_n = hand.tick(passivity).f.x(), steepest_n = 0;
  EXPECT_EQ(before_n, 2);
  for (const bool is_on : {true, false}) {
    passivity.switch_to(is_on);
    for (int i = 0; i < 400; ++i) {
      const double now_n = hand.tick(passivity).f.x();
      steepest_n = std::max(steepest_n, std::abs(now_n - before_n));
      before_n = now_n;
    }
    EXPECT_EQ(before_n < 0.5, is_on);
  }
  EXPECT_LT(steepest_n, 0.05);
  EXPECT_EQ(before_n, 2);
}

}  // namespace
}  // namespace tandem::client

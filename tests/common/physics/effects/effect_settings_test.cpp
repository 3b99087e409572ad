// Invalid settings must be refused with a message that contains the name of the field and its valid range.
#include "common/physics/effects/effect_settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/common/physics/effects/effect_support.hpp"

namespace tandem::physics {
namespace {

using ::testing::StartsWith;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(EffectSettings, DefaultsAreUsableExceptAFieldWithoutForce) {
  for (const EffectModel& model : {EffectModel(Viscosity{}), EffectModel(Magnet{}), EffectModel(Vibration{}),
                                   EffectModel(Texture{}), EffectModel(StickSlip{})}) {
    EXPECT_EQ(find_problem(effect_with(model)), "") << name_of(model);
  }
  EXPECT_THAT(find_problem(effect_with(ConstantField{})), StartsWith("constant_field.force_n is 0 0 0"));
}

TEST(EffectSettings, FirstBadFieldIsNamedWithItsRemedy) {
  struct Case {
    EffectModel model;
    std::string problem;
  };
  const Case cases[] = {
      {Viscosity{-1, 0}, "viscosity.damping_n_s_per_m is -1; it must be 0 or more and finite"},
      {Viscosity{1, kNaN}, "viscosity.damping_n_m_s_per_rad is nan; it must be 0 or more and finite"},
      {ConstantField{{0, kInfinity, 0}}, "constant_field.force_n is 0 inf 0; it must be of some length and finite"},
      {Magnet{0, 0.03, Vec3::Zero()}, "magnet.peak_force_n is 0; it must be more than 0 and finite"},
      {Magnet{1, 0, Vec3::Zero()}, "magnet.range_m is 0; it must be more than 0 and finite"},
      {Magnet{1, 0.1, {0, 0, -1}}, "magnet.core_size_m[2] is -1; it must be 0 or more and finite"},
      {Vibration{kInfinity}, "vibration.frequency_hz is inf; it must be more than 0 and finite"},
      {Vibration{100, 1, 0, Vec3::Zero()}, "vibration.direction is 0 0 0; it must be of some length and finite"},
      {Texture{0}, "texture.height_m is 0; it must be more than 0 and finite"},
      {Texture{1e-4, 1e-3, -1}, "texture.period_y_m is -1; it must be 0 or more and finite"},
      {StickSlip{500, 1, 1.5}, "stick_slip.slip_force_n is 1.5; it must be from 0 to breakaway_force_n, 1"},
  };
  for (const Case& bad : cases) EXPECT_EQ(find_problem(effect_with(bad.model)), bad.problem);
}

TEST(EffectSettings, RegionsAndLimitsAreChecked) {
  EffectSettings settings = effect_with(Viscosity{});
  settings.region = BoxRegion{{0.1, 0, 0.1}};
  EXPECT_THAT(find_problem(settings), StartsWith("box.size_m[1] is "));
  settings.region = SphereRegion{kNaN};
  EXPECT_THAT(find_problem(settings), StartsWith("sphere.radius_m is "));
  settings.region = std::monostate{};
  settings.fade_m = 0;
  EXPECT_THAT(find_problem(settings), StartsWith("fade_m is "));
  settings.fade_m = 0.01;
  settings.X_OE.q.coeffs() *= 2;
  EXPECT_THAT(find_problem(settings), StartsWith("placement is "));
}

TEST(EffectSettings, MagnetTakesNoRegionBecauseItWouldNotBeConservative) {
  EffectSettings settings = effect_with(Magnet{});
  settings.region = SphereRegion{};
  EXPECT_THAT(find_problem(settings), StartsWith("region is "));
  settings.region = std::monostate{};
  settings.in_contact = true;
  EXPECT_THAT(find_problem(settings), StartsWith("in_contact is "));
}

TEST(EffectSettings, AnEffectIsNotMadeOfBadOnes) {
  EXPECT_THROW(Effect(effect_with(Magnet{-1})), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::physics

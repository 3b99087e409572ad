// Settings that cannot be used are refused by name, with what would be right.
#include "common/physics/effects/effect_settings.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/common/physics/effects/effect_support.hpp"

namespace tandem::physics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(EffectSettings, DefaultsAreUsableExceptAFieldWithoutForce) {
  for (const EffectModel& model : {EffectModel(Viscosity{}), EffectModel(Magnet{}), EffectModel(Vibration{}),
                                   EffectModel(Texture{}), EffectModel(StickSlip{})}) {
    EXPECT_FALSE(find_problem(effect_with(model))) << name_of(model);
  }
  EXPECT_EQ(find_problem(effect_with(ConstantField{}))->field, "constant_field.force_n");
}

TEST(EffectSettings, FirstBadFieldIsNamedWithItsRemedy) {
  struct Case {
    EffectModel model;
    std::string field, value, demand;
  };
  const Case cases[] = {
      {Viscosity{-1, 0}, "viscosity.damping_n_s_per_m", "-1", "from 0 to 1000"},
      {Viscosity{1, kNaN}, "viscosity.damping_n_m_s_per_rad", "nan", "from 0 to 10"},
      {ConstantField{{0, 101, 0}}, "constant_field.force_n[1]", "101", "from -100 to 100"},
      {Magnet{0, 0.03, Vec3::Zero()}, "magnet.peak_force_n", "0", "more than 0, up to 100"},
      {Magnet{1, 0, Vec3::Zero()}, "magnet.range_m", "0", "from 0.0005 to 1"},
      {Magnet{1, 0.1, {0, 0, -1}}, "magnet.core_size_m[2]", "-1", "from 0 to 10"},
      {Vibration{401}, "vibration.frequency_hz", "401", "from 1 to 400"},
      {Vibration{100, 1, 0, Vec3::Zero()}, "vibration.direction", "0 0 0", "of some length"},
      {Texture{0.02}, "texture.height_m", "0.02", "more than 0, up to 0.01"},
      {Texture{1e-4, 1e-3, 1e-6}, "texture.period_y_m", "1e-06", "from 0.0001 to 1"},
      {StickSlip{500, 1, 1.5}, "stick_slip.slip_force_n", "1.5", "from 0 to 1"},
  };
  for (const Case& bad : cases) {
    const auto problem = find_problem(effect_with(bad.model));
    ASSERT_TRUE(problem) << bad.field;
    EXPECT_EQ(problem->field, bad.field);
    EXPECT_EQ(problem->value, bad.value);
    EXPECT_EQ(problem->demand, bad.demand);
  }
}

TEST(EffectSettings, RegionsAndLimitsAreChecked) {
  EffectSettings settings = effect_with(Viscosity{});
  settings.region = BoxRegion{{0.1, 0, 0.1}};
  EXPECT_EQ(find_problem(settings)->field, "box.size_m[1]");
  settings.region = SphereRegion{kNaN};
  EXPECT_EQ(find_problem(settings)->field, "sphere.radius_m");
  settings.region = std::monostate{};
  settings.fade_m = 0;
  EXPECT_EQ(find_problem(settings)->field, "fade_m");
  settings.fade_m = 0.01;
  settings.X_OE.q.coeffs() *= 2;
  EXPECT_EQ(find_problem(settings)->field, "placement");
}

TEST(EffectSettings, MagnetTakesNoRegionBecauseItWouldNotBeConservative) {
  EffectSettings settings = effect_with(Magnet{});
  settings.region = SphereRegion{};
  EXPECT_EQ(find_problem(settings)->field, "region");
  settings.region = std::monostate{};
  settings.in_contact = true;
  EXPECT_EQ(find_problem(settings)->field, "in_contact");
}

TEST(EffectSettings, AnEffectIsNotMadeOfBadOnes) {
  EXPECT_THROW(Effect(effect_with(Magnet{-1})), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::physics

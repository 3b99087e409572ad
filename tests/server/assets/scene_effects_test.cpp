// Tests effects in scene files: their defaults, and that each mistake is refused with a remedy.
#include "server/assets/scene_effects.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/physics/effects/effect_settings.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

using testing::HasSubstr;

/// Returns the JSON of a wall with the effects `json`.
std::string wall_with(const std::string& json) {
  const std::string wall = physics::kWall;
  return wall.substr(0, wall.size() - 1) + R"(, "effects": [)" + json + "]}";
}

std::string refusal(const physics::SceneParts& parts) {
  try {
    physics::load_parts(parts);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "accepted";
}
std::string body_refusal(const std::string& effect) {
  return refusal({.bodies = wall_with(effect)});
}
std::string scene_refusal(const std::string& effect) {
  return refusal({.rest = R"("effects": [)" + effect + "]"});
}

TEST(SceneEffects, ReachTheWorldAsWritten) {
  const auto scene = physics::load_parts(
      {.bodies = wall_with(R"({"label": "l", "placement": {"position_m": [1, 2, 3]}, "fade_m": 0.02, "in_contact": true,
                               "box": {"size_m": [1, 2, 3]}, "full_contact_n": 0.5, "force_limit_n": 2,
                               "torque_limit_n_m": 0.3, "stick_slip": {"stiffness_n_per_m": 700,
                               "breakaway_force_n": 2, "slip_force_n": 1}})"),
       .rest = R"("effects": [{"sphere": {"radius_m": 0.2}, "vibration": {"frequency_hz": 50, "direction": [1, 0, 0]}},
                              {"constant_field": {"force_n": [1, 2, 3]}},
                              {"magnet": {"core_size_m": [0.1, 0, 0]}}])"});
  ASSERT_EQ(scene->world.effects.size(), 4U);
  const physics::EffectSettings& pad = scene->world.effects[0];
  EXPECT_EQ(pad.owner, 0U);
  EXPECT_EQ(pad.X_OE.p, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<physics::BoxRegion>(pad.region).size_m, Vec3(1, 2, 3));
  EXPECT_TRUE(pad.in_contact);
  EXPECT_EQ(pad.fade_m, 0.02);
  EXPECT_EQ(pad.full_contact_n, 0.5);
  EXPECT_EQ(pad.force_limit_n, 2);
  EXPECT_EQ(pad.torque_limit_n_m, 0.3);
  const physics::StickSlip& model = std::get<physics::StickSlip>(pad.model);
  EXPECT_EQ(model.stiffness_n_per_m, 700);
  EXPECT_EQ(model.breakaway_force_n, 2);
  EXPECT_EQ(model.slip_force_n, 1);
  EXPECT_FALSE(scene->world.effects[1].owner);
  EXPECT_EQ(std::get<physics::SphereRegion>(scene->world.effects[1].region).radius_m, 0.2);
  EXPECT_EQ(std::get<physics::Vibration>(scene->world.effects[1].model).direction, Vec3(1, 0, 0));
  EXPECT_EQ(std::get<physics::ConstantField>(scene->world.effects[2].model).force_n, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<physics::Magnet>(scene->world.effects[3].model).core_size_m, Vec3(0.1, 0, 0));
}

TEST(SceneEffects, ABodysEffectWithoutRegionActsInContactUnlessItIsAMagnet) {
  const auto scene = physics::load_parts({.bodies = wall_with(R"({"viscosity": {}}, {"magnet": {}},
                                         {"sphere": {"radius_m": 1}, "viscosity": {}},
                                         {"in_contact": false, "viscosity": {}})"),
                                          .rest = R"("effects": [{"viscosity": {}}])"});
  std::vector<bool> in_contact;
  for (const physics::EffectSettings& effect : scene->world.effects) in_contact.push_back(effect.in_contact);
  EXPECT_EQ(in_contact, (std::vector<bool>{true, false, false, false, false}));
}

TEST(SceneEffects, ARefusalNamesFileFieldValueAndRemedy) {
  EXPECT_EQ(body_refusal(R"({"viscosity": {"damping_n_s_per_m": -1}})"),
            "test.json: bodies[0].effects[0].viscosity.damping_n_s_per_m is -1 N·s/m; it must be from 0 to 1000 N·s/m");
  EXPECT_EQ(scene_refusal(R"({"viscosity": {}}, {"magnet": {"range_m": 0}})"),
            "test.json: effects[1].magnet.range_m is 0 m; it must be from 0.0005 to 1 m");
  EXPECT_EQ(body_refusal(R"({"box": {"size_m": [1, 0, 1]}, "viscosity": {}})"),
            "test.json: bodies[0].effects[0].box.size_m[1] is 0 m; it must be from 1e-06 to 100 m");
  EXPECT_THAT(body_refusal(R"({"box": {"size_m": [1]}, "viscosity": {}})"), HasSubstr("has 1 numbers; it must have 3"));
  EXPECT_THAT(body_refusal(R"({"constant_field": {}})"), HasSubstr("constant_field.force_n is 0 0 0; it must be"));
  EXPECT_THAT(body_refusal(R"({"sphere": {"radius_m": 1}, "magnet": {}})"),
              HasSubstr("effects[0].region is given; it must be left out for a magnet"));
  EXPECT_THAT(body_refusal(R"({"stick_slip": {"breakaway_force_n": 1, "slip_force_n": 2}})"),
              HasSubstr("stick_slip.slip_force_n is 2; it must be from 0 to breakaway_force_n, 1"));
  EXPECT_THAT(body_refusal(R"({"label": ")" + std::string(65, 'x') + R"(", "viscosity": {}})"),
              HasSubstr("effects[0].label has 65 bytes; it must have at most 64"));
}

TEST(SceneEffects, AnEffectOfNoOrUnknownKindIsRefusedWithTheKnownKinds) {
  EXPECT_EQ(body_refusal(R"({"label": "x"})"),
            "test.json: bodies[0].effects[0] has no kind; it must have one of " + physics::listed_effect_names());
  for (const std::string& text :
       {body_refusal(R"({"glue": {}})"), scene_refusal(R"({"viscosity": {}}, {"glue": {}})")}) {
    EXPECT_THAT(text,
                HasSubstr(".glue is not a field of an effect; its kind is one of " + physics::listed_effect_names()));
  }
}

TEST(SceneEffects, TheSceneHasNoSurfaceForTextureOrContact) {
  EXPECT_THAT(scene_refusal(R"({"texture": {}})"), HasSubstr("effects[0].texture has no surface to be on; attach"));
  EXPECT_THAT(scene_refusal(R"({"in_contact": true, "viscosity": {}})"), HasSubstr("effects[0].in_contact is true"));
}

TEST(SceneEffects, VibrationMustBeSampledOftenEnough) {
  const std::string vibration = R"("effects": [{"vibration": {"frequency_hz": 100}}], "step_rate_hz": )";
  EXPECT_EQ(refusal({.rest = vibration + "250"}), "accepted");
  EXPECT_THAT(refusal({.rest = vibration + "240"}), HasSubstr("frequency_hz is 100; it must be at most 96, 0.4 times"));
}

TEST(SceneEffects, AreAtMost32WithThoseOfTheBodies) {
  const auto effects = [](int count) {
    std::string text = R"({"viscosity": {}})";
    for (int i = 1; i < count; ++i) text += R"(, {"viscosity": {}})";
    return text;
  };
  const std::string rest = R"("effects": [)" + effects(16) + "]";
  EXPECT_EQ(refusal({.bodies = wall_with(effects(16)), .rest = rest}), "accepted");
  EXPECT_THAT(refusal({.bodies = wall_with(effects(17)), .rest = rest}), HasSubstr("33 effects; at most 32"));
}

}  // namespace
}  // namespace tandem::server

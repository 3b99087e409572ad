#include "lab/experiment/quantities.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "common/base/json_fields.hpp"
#include "lab/experiment/experiment.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

json::object document(const std::string& text) {
  return parse_json(text, "e.json").get_object();
}

json::object two_users() {
  return document(R"({"name": "e", "scene": "two_boxes", "link": {"rtt_ms": 50, "loss": 0.01},
    "users": [{"name": "anna", "stage": "hold", "link": {"rtt_ms": 10, "jitter_ms": 3}, "downlink": {"rtt_ms": 400}},
              {"name": "ben"}]})");
}

json::object with(const std::string& name, const json::value& value) {
  json::object result = two_users();
  set_quantity(result, name, value);
  return result;
}

json::object complete() {
  return experiment_json(parse_experiment({"e.json", ".", two_users()}));
}

TEST(ParseAxis, AcceptsOneOrSeveralValuesOfAnyKind) {
  const Axis one = parse_axis("stage=hold");
  EXPECT_EQ(one.name, "stage");
  EXPECT_THAT(one.values, testing::ElementsAre(json::value("hold")));
  EXPECT_THAT(parse_axis("link.rtt_ms=0,50,1e2").values, testing::ElementsAre(0, 50, 100.0));
  EXPECT_THAT(parse_axis("passivity=true,false").values, testing::ElementsAre(true, false));
  EXPECT_THAT(parse_axis("link.trace_ms=[1,2],[3]").values, testing::ElementsAre(json::array{1, 2}, json::array{3}))
      << "commas in brackets do not divide";
  EXPECT_THAT(parse_axis("users.ben.hand=\"a,b\"").values, testing::ElementsAre(json::value("a,b")));
}

TEST(ParseAxis, AcceptsTheOlderNameOfAQuantity) {
  EXPECT_EQ(parse_axis("guard=true").name, "passivity");
  EXPECT_EQ(parse_axis("users.ben.guard=true").name, "users.ben.passivity");
  EXPECT_EQ(parse_axis("users.guard.stage=hold").name, "users.guard.stage");
}

TEST(ParseAxis, NamesTheMissingPart) {
  for (const char* text : {"stage", "=hold", "stage="}) {
    EXPECT_THAT([&] { parse_axis(text); },
                ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(text), HasSubstr("NAME=VALUE"))))
        << text;
  }
  EXPECT_THAT([] { parse_axis("link.rtt_ms=1,,2"); }, ThrowsMessage<std::invalid_argument>(HasSubstr("empty value")));
}

TEST(SetQuantity, OfAllUsersReplacesThatOfEachUser) {
  const json::object stage = with("stage", "late-pose");
  EXPECT_EQ(stage.at("stage"), json::value("late-pose"));
  EXPECT_FALSE(stage.at("users").at(0).as_object().contains("stage"));
  const json::object rtt = with("link.rtt_ms", 130);
  EXPECT_EQ(rtt.at("link").at("rtt_ms"), json::value(130));
  EXPECT_EQ(rtt.at("link").at("loss"), json::value(0.01)) << "the rest of the link stays";
  EXPECT_FALSE(rtt.at("users").at(0).at("link").as_object().contains("rtt_ms"));
  EXPECT_FALSE(rtt.at("users").at(0).at("downlink").as_object().contains("rtt_ms"));
  EXPECT_EQ(rtt.at("users").at(0).at("link").at("jitter_ms"), json::value(3));
}

TEST(SetQuantity, OfTheHandsAndOfOneUser) {
  const json::object mass = with("hand.mass_kg", 0.5);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(mass.at("users").at(i).at("hand_parameters").at("mass_kg"), json::value(0.5));
  EXPECT_EQ(with("users.1.link.rtt_ms", 200).at("users").at(1).at("link").at("rtt_ms"), json::value(200));
  EXPECT_EQ(with("users.ben.link.rtt_ms", 200), with("users.1.link.rtt_ms", 200));
  EXPECT_THAT([] { with("users.cleo.stage", "hold"); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("users.cleo"), HasSubstr("0 anna, 1 ben"))));
  EXPECT_THROW(with("users.2.stage", "hold"), std::invalid_argument);
}

TEST(SetQuantity, ReachesTheScene) {
  const json::object changed = with("scene.bodies.light_box.mass_kg", 0.4);
  const Experiment experiment = parse_experiment({"e.json", ".", changed});
  EXPECT_NEAR(load_experiment_scene(experiment)->description.bodies(1).mass_kg(), 0.4, 1e-12);
  Experiment stiff = parse_experiment({"e.json", ".", with("coupling.stiffness_n_per_m", 123)});
  EXPECT_EQ(load_experiment_scene(stiff)->world.coupling.parameters.stiffness_n_per_m, 123);
  const Experiment other_law = parse_experiment({"e.json", ".", with("law", "qsa-static")});
  EXPECT_EQ(load_experiment_scene(other_law)->description.coupling().law(), "qsa-static");
  const Experiment wrong = parse_experiment({"e.json", ".", with("scene.bodies.no_box.mass_kg", 1)});
  EXPECT_THAT([&] { load_experiment_scene(wrong); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("scene.bodies.no_box.mass_kg")));
}

TEST(CheckQuantity, AcceptsEveryFieldAndSuggestsTheNearestName) {
  const json::object all = complete();
  for (const char* name : {"stage", "passivity", "predictor", "seed", "duration_s", "link.rtt_ms", "link.trace_ms",
                           "hand.mass_kg", "device", "users.1.link.loss", "users.ben.stage", "model.mass_scale", "law",
                           "coupling.stiffness_n_per_m", "scene.bodies.cube.friction"}) {
    EXPECT_NO_THROW(check_quantity(all, name)) << name;
  }
  const std::pair<const char*, const char*> misspelt[] = {{"link.rt_ms", "did you mean link.rtt_ms?"},
                                                          {"stge", "did you mean stage?"},
                                                          {"hand.mas_kg", "did you mean hand.mass_kg?"},
                                                          {"users.ben.stagee", "did you mean users.0.stage?"}};
  for (const auto& [name, guess] : misspelt) {
    const auto check = [&all, name = name] { check_quantity(all, name); };
    EXPECT_THAT(check, ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr(guess), HasSubstr("known: ")))) << name;
  }
  EXPECT_THROW(check_quantity(all, "users"), std::invalid_argument);
  EXPECT_THROW(check_quantity(all, "scene."), std::invalid_argument);
}

TEST(EditDistance, CountsLetters) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", "abc"), 0U);
}

}  // namespace
}  // namespace tandem::lab

#include "lab/experiment/trial_grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"

namespace tandem::lab {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// Number of stages that can render every scene: all except the god-object.
const std::size_t kGeneralStages = known_stages().size() - 1;

ExperimentFile file(const std::string& more) {
  return {"e.json", ".",
          parse_json(R"({"name": "e", "scene": "two_boxes", "users": [{"name": "anna"}, {"name": "ben"}])" + more + "}",
                     "e.json")
              .get_object()};
}

GridRequest asking(const std::vector<std::string>& settings) {
  GridRequest request;
  for (const std::string& setting : settings) request.axes.push_back(parse_axis(setting));
  return request;
}

std::size_t count(const std::string& more, const GridRequest& request = {}) {
  return expand(file(more), request).size();
}

TEST(TrialGrid, WithoutAGridIsTheBuiltIn) {
  // The default stage has 7 delays × 2 jitters × 2 losses × 3 seeds. Each of the other stages that can render every
  // scene has 4 delays and one seed.
  EXPECT_EQ(count(""), 7 * 2 * 2 * 3 + 4 * (kGeneralStages - 1));
  for (const Trial& trial : expand(file(""), {})) {
    EXPECT_EQ(trial.experiment.pipeline.passivity, trial.experiment.pipeline.stage == default_stage());
  }
}

TEST(TrialGrid, IsTheProductOfItsAxesTimesSeeds) {
  EXPECT_EQ(count(R"(, "seeds": 2, "grid": [{"link.rtt_ms": [0, 10, 20], "link.loss": [0, 0.05]}])"), 12U);
  EXPECT_EQ(count(R"(, "seeds": 2, "grid": [{"link.rtt_ms": [0, 10]}, {"link.rtt_ms": 20, "seeds": 1}])"), 5U);
  EXPECT_EQ(count(R"(, "seeds": 2, "grid": [{"stage": "others"}])"), 2 * (kGeneralStages - 1));
  EXPECT_EQ(count(R"(, "seeds": 5, "grid": [])"), 1U) << "an empty grid gives one trial of the file";
}

TEST(TrialGrid, TheSameTrialIsRunOnce) {
  EXPECT_EQ(count(R"(, "seeds": 1, "grid": [{"link.rtt_ms": [0, 10]}, {"link.rtt_ms": [10, 20]}])"), 3U);
  EXPECT_EQ(count(R"(, "seeds": 1, "grid": [{"link.rtt_ms": [10, 10.0]}])"), 1U);
}

TEST(TrialGrid, TheCommandLineReplacesAxesAndAddsOthers) {
  const std::string grid = R"(, "seeds": 1, "grid": [{"link.rtt_ms": [0, 10, 20], "passivity": [true, false]}])";
  EXPECT_EQ(count(grid, asking({"link.rtt_ms=130"})), 2U);
  EXPECT_EQ(count(grid, asking({"hand.mass_kg=0.2,0.5"})), 12U);
  GridRequest single = asking({"link.rtt_ms=5,7"});
  single.is_single = true;
  EXPECT_EQ(count(grid, single), 2U);
  single.seeds = 4;
  EXPECT_EQ(count(grid, single), 8U);
}

TEST(TrialGrid, SeedsCountFromTheFirst) {
  std::set<std::uint64_t> seeds;
  GridRequest request = asking({"seed=7"});
  request.is_single = true;
  request.seeds = 3;
  for (const Trial& trial : expand(file(""), request)) seeds.insert(trial.experiment.seed);
  EXPECT_THAT(seeds, testing::ElementsAre(7, 8, 9));
  request.axes = {parse_axis("seed=3,5")};
  seeds.clear();
  for (const Trial& trial : expand(file(""), request)) seeds.insert(trial.experiment.seed);
  EXPECT_THAT(seeds, testing::ElementsAre(3, 5)) << "listed one by one";
}

TEST(TrialGrid, TheFullProductHasEveryGeneralStageAndPredictorWithAndWithoutPassivityController) {
  GridRequest full;
  full.is_full = true;
  full.seeds = 1;
  EXPECT_EQ(count("", full), kGeneralStages * known_predictors().size() * 2 * 8 * 2 * 2);
}

TEST(TrialGrid, AcceptsTheOlderNameOfPassivity) {
  const std::string grid = R"(, "seeds": 1, "grid": [{"guard": [true, false]}])";
  EXPECT_EQ(count(grid), 2U);
  EXPECT_EQ(count(grid, asking({"passivity=false"})), 1U) << "both names must select the same axis";
}

TEST(TrialGrid, LaterSettingsOfOneUserStandAgainstThoseOfAll) {
  GridRequest request = asking({"link.rtt_ms=100", "users.1.link.rtt_ms=200"});
  request.is_single = true;
  const std::vector<Trial> trials = expand(file(""), request);
  ASSERT_EQ(trials.size(), 1U);
  EXPECT_EQ(trials[0].experiment.users[0].up.delay, from_seconds(0.050));
  EXPECT_EQ(trials[0].experiment.users[1].up.delay, from_seconds(0.100));
  EXPECT_EQ(trials[0].experiment.users[1].down.delay, from_seconds(0.100));
  EXPECT_EQ(round_trip_of(trials[0].experiment.users[1]), from_seconds(0.200));
}

TEST(TrialGrid, TheReferenceHasTheSameHandsOnAPerfectLink) {
  GridRequest request = asking({"link.rtt_ms=100", "users.1.link.loss=0.1", "stage=hold", "hand.mass_kg=0.5",
                                "model.mass_scale=1.4", "deadband=0.1", "seed=5"});
  request.is_single = true;
  const Trial trial = expand(file(""), request).at(0);
  EXPECT_EQ(same_stage_of(trial).experiment.users[0].pipeline.stage, "hold");
  EXPECT_EQ(same_stage_of(trial).experiment.users[0].up.delay, Duration(0));
  const Trial reference = reference_of(trial);
  EXPECT_EQ(reference.experiment.seed, 5U);
  for (const ExperimentUser& user : reference.experiment.users) {
    EXPECT_EQ(user.hand_parameters.mass_kg, 0.5);
    EXPECT_EQ(user.pipeline.stage, "late-pose");
    EXPECT_FALSE(user.pipeline.passivity);
    EXPECT_EQ(user.pipeline.deadband, 0);
    EXPECT_TRUE(user.pipeline.model == client::ModelErrors{});
    EXPECT_EQ(user.up.delay, Duration(0));
    EXPECT_EQ(user.up.loss, 0);
    EXPECT_EQ(user.down.loss, 0);
  }
}

TEST(TrialGrid, RefusesUnknownSettingsAndTooManyTrials) {
  EXPECT_THAT([] { expand(file(""), asking({"link.rt_ms=1"})); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("did you mean link.rtt_ms?")));
  EXPECT_THAT([] { expand(file(R"(, "grid": [{"stge": "hold"}])"), {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("did you mean stage?")));
  EXPECT_THAT([] { expand(file(""), asking({"stage=telepathy"})); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("stage is \"telepathy\"; it must be one of")));
  EXPECT_THAT([] { expand(file(R"(, "grid": [{"link.rtt_ms": []}])"), {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("grid[0].link.rtt_ms is an empty list")));
  EXPECT_THROW(expand(file(R"(, "grid": {"link.rtt_ms": [1]})"), {}), std::invalid_argument);
  GridRequest many = asking({"link.rtt_ms=1,2,3,4,5,6,7,8,9,10", "link.jitter_ms=1,2,3,4,5,6,7,8,9,10"});
  many.is_single = true;
  many.seeds = 1000;
  EXPECT_THAT([&] { expand(file(""), many); }, ThrowsMessage<std::invalid_argument>(HasSubstr("more than 20000")));
}

TEST(ExperimentJson, ReadsBackToTheSameTrial) {
  const Experiment first = parse_experiment(file(R"(, "link": {"rtt_ms": 50, "loss": 0.1, "distribution": "trace",
      "trace_ms": [1, 2.5]}, "passivity": false, "deadband": 0.1, "coupling": {"stiffness_n_per_m": 200},
      "outcome": {"body": "light_box", "lifted_above_m": 0.05, "during": "hold"}, "users": [
      {"name": "anna", "hand": "press-down", "link": {"rtt_ms": 10}, "downlink": {"loss": 0.2}}])"));
  const boost::json::object complete = experiment_json(first);
  EXPECT_EQ(pretty_json(experiment_json(parse_experiment({"again", ".", complete}))), pretty_json(complete));
}

}  // namespace
}  // namespace tandem::lab

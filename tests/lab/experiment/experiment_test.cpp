#include "lab/experiment/experiment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/base/json_pretty.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "tests/support/source_path.hpp"

namespace tandem::lab {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A folder with a scene file to which experiments can refer.
class ReadExperiment : public testing::Test {
 protected:
  ReadExperiment()
      : folder_(std::filesystem::path(testing::TempDir()) /
                (std::string("experiment_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "scene.json") << "{}";
    std::ofstream(folder_ / "hand.json") << R"({"points": [{"t_s": 1, "phase": "wave"}]})";
  }
  ~ReadExperiment() override { std::filesystem::remove_all(folder_); }

  Experiment parse(const std::string& json) const { return parse_experiment(json, "e.json", folder_); }
  std::string complaint(const std::string& json) const {
    try {
      parse(json);
      return "accepted";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
};

TEST_F(ReadExperiment, EveryFieldArrives) {
  const Experiment experiment = parse(R"({
      "name": "n", "description": "d", "scene": "./scene.json", "duration_s": 2.5, "seed": 9, "server_phase_ms": 0.5,
      "sample_period_ms": 2, "link": {"rtt_ms": 9, "queue_limit": 12}, "deadband": 0.1, "passivity": false,
      "model": {"mass_scale": 1.4}, "assets": "fetched", "reference_stage": "hold", "law": "qsa-static",
      "coupling": {"stiffness_n_per_m": 250}, "scene_changes": {"bodies.cube.friction": 0.5},
      "outcome": {"body": "cube", "lifted_above_m": 0.05, "during": "wave"}, "seeds": 4, "grid": [],
      "users": [{
        "name": "anna", "role": "observer", "hand": "hand.json", "device": "omega.6", "stage": "hold", "passivity": true,
        "transport": "udp", "tick_phase_ms": 0.75,
        "hand_parameters": {"mass_kg": 0.4, "stiffness_n_per_m": 100, "damping_n_s_per_m": 5, "inertia_kg_m2": 0.001,
          "stiffness_n_m_per_rad": 1, "damping_n_m_s_per_rad": 0.1, "tremor_rms_n": 0.2, "tremor_hz": 8,
          "encoder_step_m": 2e-5, "encoder_step_rad": 1e-4},
        "link": {"rtt_ms": 50, "jitter_ms": 5, "distribution": "trace", "trace_ms": [1, 2.5], "loss": 0.05,
          "bad_period_ms": 30, "duplication": 0.01, "reordering": true, "rate_limit_bytes_per_s": 1e6},
        "downlink": {"rtt_ms": 200, "distribution": "pareto"}}]})");
  EXPECT_EQ(experiment.name, "n");
  EXPECT_EQ(experiment.description, "d");
  EXPECT_TRUE(std::filesystem::equivalent(experiment.scene, folder_ / "scene.json"));
  EXPECT_EQ(experiment.duration, milliseconds(2500));
  EXPECT_EQ(experiment.seed, 9U);
  EXPECT_EQ(experiment.server_phase, microseconds(500));
  EXPECT_EQ(experiment.sample_period, milliseconds(2));
  ASSERT_EQ(experiment.users.size(), 1U);
  const ExperimentUser& user = experiment.users[0];
  EXPECT_EQ(user.name, "anna");
  EXPECT_EQ(user.role, server::UserRole::kObserver);
  EXPECT_THAT(user.hand.phases(), testing::ElementsAre("wave"));
  EXPECT_EQ(user.device.name, "omega.6");
  EXPECT_FALSE(user.device.has_torque());
  EXPECT_EQ(user.pipeline.stage, "hold");
  EXPECT_TRUE(user.pipeline.passivity) << "the user's own";
  EXPECT_FALSE(experiment.pipeline.passivity);
  EXPECT_EQ(user.pipeline.deadband, 0.1);
  EXPECT_EQ(user.pipeline.model.mass_scale, 1.4);
  EXPECT_EQ(experiment.assets, "fetched");
  EXPECT_EQ(experiment.reference_stage, "hold");
  EXPECT_EQ(experiment.scene_changes.at("bodies.cube.friction"), boost::json::value(0.5));
  EXPECT_EQ(experiment.scene_changes.at("coupling.law"), boost::json::value("qsa-static"));
  EXPECT_EQ(experiment.scene_changes.at("coupling.stiffness_n_per_m"), boost::json::value(250));
  ASSERT_TRUE(experiment.outcome.has_value());
  EXPECT_EQ(experiment.outcome->body, "cube");
  EXPECT_EQ(experiment.outcome->lifted_above_m, 0.05);
  EXPECT_EQ(experiment.outcome->during, "wave");
  EXPECT_FALSE(user.state_over_tcp);
  EXPECT_EQ(user.tick_phase, microseconds(750));
  EXPECT_EQ(user.hand_parameters.mass_kg, 0.4);
  EXPECT_EQ(user.hand_parameters.stiffness_n_per_m, 100);
  EXPECT_EQ(user.hand_parameters.damping_n_s_per_m, 5);
  EXPECT_EQ(user.hand_parameters.inertia_kg_m2, 0.001);
  EXPECT_EQ(user.hand_parameters.stiffness_n_m_per_rad, 1);
  EXPECT_EQ(user.hand_parameters.damping_n_m_s_per_rad, 0.1);
  EXPECT_EQ(user.hand_parameters.tremor_rms_n, 0.2);
  EXPECT_EQ(user.hand_parameters.tremor_hz, 8);
  EXPECT_EQ(user.hand_parameters.encoder_step_m, 2e-5);
  EXPECT_EQ(user.hand_parameters.encoder_step_rad, 1e-4);
  EXPECT_EQ(user.up.delay, milliseconds(25));
  EXPECT_EQ(user.up.jitter, milliseconds(5));
  EXPECT_EQ(user.up.distribution, net::JitterDistribution::kTrace);
  EXPECT_THAT(user.up.trace, testing::ElementsAre(milliseconds(1), microseconds(2500)));
  EXPECT_EQ(user.up.loss, 0.05);
  EXPECT_EQ(user.up.mean_bad_period, milliseconds(30));
  EXPECT_EQ(user.up.duplication, 0.01);
  EXPECT_TRUE(user.up.allows_reordering);
  EXPECT_EQ(user.up.rate_limit_bytes_per_s, 1e6);
  EXPECT_EQ(user.up.queue_limit, 12U);
  EXPECT_EQ(user.down.delay, milliseconds(100));
  EXPECT_EQ(user.down.loss, 0.05) << "settings missing in downlink must be those of link";
  EXPECT_EQ(user.down.distribution, net::JitterDistribution::kPareto);
}

TEST_F(ReadExperiment, KeepsDefaultsForMissingSettings) {
  const Experiment experiment = parse(
      R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a", "link": {"rtt_ms": 14}}, {"name": "b"}]})");
  EXPECT_EQ(experiment.duration, seconds(10));
  EXPECT_EQ(experiment.users[0].pipeline.stage, default_stage());
  EXPECT_FALSE(experiment.users[0].state_over_tcp);
  EXPECT_EQ(experiment.users[0].down.delay, milliseconds(7)) << "without downlink, the settings of link apply";
  EXPECT_EQ(experiment.users[0].tick_phase, microseconds(250));
  EXPECT_EQ(experiment.users[1].tick_phase, microseconds(500));
  EXPECT_EQ(experiment.users[1].hand_parameters.mass_kg, devices::HandParameters{}.mass_kg);
  EXPECT_EQ(experiment.users[1].device.name, "sim");
}

std::string one_user(const std::string& fields) {
  return R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a", )" + fields + "}]}";
}

TEST_F(ReadExperiment, AStreamMayBeSlowButLosesNothing) {
  const Experiment experiment = parse(one_user(R"("transport": "tcp", "link": {"rtt_ms": 14, "jitter_ms": 1})"));
  EXPECT_TRUE(experiment.users[0].state_over_tcp);
  for (const char* spoilt :
       {R"("link": {"loss": 0.01})", R"("downlink": {"duplication": 0.01})", R"("downlink": {"reordering": true})"}) {
    EXPECT_EQ(complaint(one_user(std::string(R"("transport": "tcp", )") + spoilt)),
              "e.json: users[0].transport is \"tcp\"; over a stream nothing is lost, doubled or reordered; leave out "
              "loss, duplication and reordering, or use udp");
  }
}

TEST_F(ReadExperiment, ADelayPathIsAFileBesideItOrAShippedOne) {
  std::ofstream(folder_ / "ramp.json") << R"({"times_s": [0, 2], "delays_ms": [0, 30], "starts_anywhere": false})";
  const Experiment own = parse(one_user(R"("link": {"delay_path": "ramp.json"})"));
  const net::DelayPath& path = own.users.at(0).up.delay_path;
  EXPECT_EQ(path.at(seconds(1)), milliseconds(15));
  EXPECT_FALSE(path.starts_anywhere);
  EXPECT_EQ(own.users[0].down.delay_path, path);
  for (const std::string name : {"drift", "steps", "wifi"}) {
    const Experiment shipped = parse(one_user(R"("link": {"delay_path": ")" + name + "\"}"));
    EXPECT_EQ(shipped.users.at(0).up.delay_path.length(), seconds(60)) << name;
    EXPECT_EQ(parse(compact_json(experiment_json(shipped))).users.at(0).up.delay_path,
              shipped.users.at(0).up.delay_path);
  }
  std::ofstream(folder_ / "short.json") << R"({"times_s": [0, 1], "delays_ms": [0]})";
  EXPECT_THAT(complaint(one_user(R"("link": {"delay_path": "short.json"})")),
              testing::HasSubstr("must have the same number of values"));
}

TEST_F(ReadExperiment, NamesTheErrorItsPositionAndTheRemedy) {
  const std::pair<std::string, std::string> cases[] = {
      {"{", "e.json: line 1, column 2: incomplete JSON; it must be one valid JSON value"},
      {"{}", "e.json: name is missing; it must be a text in quotes"},
      {R"({"name": "n", "scene": "./scene.json"})", "e.json: users is missing; it must be a list of 1 to 16 objects"},
      {R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a"}], "sed": 1})",
       "e.json: sed is 1; there is no such field here; known: assets, coupling, deadband, description, duration_s, "
       "grid, "
       "law, link, model, name, outcome, passivity, predictor, reference_stage, sample_period_ms, scene, "
       "scene_changes, seed, "
       "seeds, server_phase_ms, stage, users"},
      {R"({"name": "n", "scene": "./scene.json", "seed": -1, "users": [{"name": "a"}]})",
       "e.json: seed is -1; it must be a whole number from 0 to 9007199254740992"},
      {R"({"name": "n", "scene": "./scene.json", "duration_s": 601, "users": [{"name": "a"}]})",
       "e.json: duration_s is 601; it must be a number from 0.1 to 600"},
      {R"({"name": "n", "scene": "./scene.json", "duration_s": 500,
           "users": [{"name": "a"}, {"name": "b"}, {"name": "c"}]})",
       "e.json: duration_s is 500; duration times users must be at most 1200 s"},
      {R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a"}, {"name": "a"}]})",
       "e.json: users[1].name is \"a\"; each user needs a name of its own"},
      {R"({"name": "n", "scene": "./scene.json", "assets": "there", "users": [{"name": "a"}]})",
       "e.json: assets is \"there\"; it must be one of here, fetched, fetched-in-turn"},
      {one_user(R"("stage": "telepathy")"),
       "e.json: users[0].stage is \"telepathy\"; it must be one of " + listed_stages()},
      {one_user(R"("role": "king")"),
       "e.json: users[0].role is \"king\"; it must be one of manipulator, observer, operator"},
      {one_user(R"("transport": 7)"), "e.json: users[0].transport is 7; it must be a text in quotes"},
      {one_user(R"("tick_phase_ms": 0.3)"), "e.json: users[0].tick_phase_ms is 0.3; it must be 0, 0.25, 0.5 or 0.75"},
      {one_user(R"("link": {"loss": 1.2})"), "e.json: users[0].link.loss is 1.2; it must be a number from 0 to 0.95"},
      {one_user(R"("link": {"rtt_ms": -1})"),
       "e.json: users[0].link.rtt_ms is -1; it must be a number from 0 to 20000"},
      {one_user(R"("link": {"delay_ms": 1})"),
       "e.json: users[0].link.delay_ms is 1; there is no such field here; known: bad_period_ms, delay_path, "
       "distribution, duplication, jitter_correlation_ms, jitter_ms, loss, queue_limit, rate_limit_bytes_per_s, "
       "reordering, rtt_ms, trace_ms"},
      {R"({"name": "n", "scene": "./scene.json", "link": {"loss": 2}, "users": [{"name": "a"}]})",
       "e.json: link.loss is 2; it must be a number from 0 to 0.95"},
      {R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a"}],
           "outcome": {"body": "cube", "lifted_above_m": 0.1, "during": "carry"}})",
       "e.json: outcome.during is \"carry\"; the first user's hand has no such phase; it has: hold"},
      {R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a"}],
           "outcome": {"body": "cube", "ends_at_m": [0, 0, 0.03]}})",
       "e.json: outcome.within_m is missing; it must be a number from 0 to 10"},
      {R"({"name": "n", "scene": "./scene.json", "users": [{"name": "a"}],
           "outcome": {"body": "cube", "ends_at_m": [0, 0, 0.03], "within_m": 0.002, "during": "hold"}})",
       "e.json: outcome.during is \"hold\"; there is no such field here; known: body, ends_at_m, within_m"},
      {one_user(R"("link": {"distribution": "trace"})"),
       "e.json: users[0].link.trace_ms is missing; distribution \"trace\" needs a list of one delay or more"},
      {one_user(R"("link": {"reordering": "yes"})"),
       "e.json: users[0].link.reordering is \"yes\"; it must be true or false"},
      {one_user(R"("link": {"queue_limit": 0})"), "e.json: users[0].link.queue_limit is 0; it must be 1 or more"},
      {one_user(R"("hand_parameters": {"mass_kg": 0})"),
       "e.json: users[0].hand_parameters.mass_kg is 0; it must be a number from 0.01 to 10"},
  };
  for (const auto& [json, message] : cases) EXPECT_EQ(complaint(json), message);
  EXPECT_THAT(complaint(one_user(R"("link": {"delay_path": "pigeon"})")),
              testing::AllOf(testing::StartsWith("e.json: users[0].link.delay_path is \"pigeon\""),
                             testing::HasSubstr("shipped: drift, steps, wifi")));
  EXPECT_THAT(complaint(one_user(R"("hand": "peg-middle")")),
              testing::AllOf(testing::StartsWith("e.json: users[0].hand is \"peg-middle\""),
                             testing::HasSubstr("known: rest, ")));
  EXPECT_THAT(complaint(one_user(R"("device": "omega.9")")),
              testing::AllOf(testing::StartsWith("e.json: users[0].device is \"omega.9\""),
                             testing::HasSubstr("one of: sim, ")));
  EXPECT_THAT(complaint(one_user(R"("device": "mine.json")")), testing::HasSubstr("mine.json: cannot be read"));
  EXPECT_THAT(complaint(one_user(R"("hand": "none.json")")), testing::HasSubstr("none.json: cannot be read"));
  EXPECT_THAT(complaint(R"({"name": "n", "scene": "no_such_scene", "users": [{"name": "a"}]})"),
              testing::AllOf(testing::StartsWith("e.json: scene: scene \"no_such_scene\" is neither"),
                             testing::HasSubstr("peg_in_hole")));
}

TEST(ShippedExperiments, AreAllGood) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::source_path("lab/experiments"))) {
    ++count;
    EXPECT_NO_THROW({
      const Experiment experiment = load_experiment(entry.path());
      EXPECT_EQ(experiment.name, entry.path().stem())
          << "the name is the file's, so that results say where they are from";
    }) << entry.path();
  }
  EXPECT_GE(count, 2);
}

TEST(ExperimentLibrary, FindsShippedOnesByNameAndAllWithout) {
  const std::vector<std::string> names{"wall", (shipped_experiments() / "free.json").string()};
  const auto files = experiment_files(names);
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files[0].filename(), "wall.json");
  EXPECT_EQ(files[1].filename(), "free.json");
  EXPECT_GE(experiment_files({}).size(), 11U);
  const std::vector<std::string> unknown{"wal"};
  EXPECT_THAT([&] { experiment_files(unknown); },
              testing::ThrowsMessage<std::invalid_argument>(testing::AllOf(
                  testing::HasSubstr("\"wal\" is neither a file nor shipped"), testing::HasSubstr("wall"))));
}

TEST_F(ReadExperiment, MayHaveTheOlderNameOfPassivity) {
  const Experiment experiment = parse(R"({"name": "n", "scene": "./scene.json", "guard": false,
      "users": [{"name": "a"}, {"name": "b", "guard": true}]})");
  EXPECT_FALSE(experiment.pipeline.passivity);
  EXPECT_FALSE(experiment.users[0].pipeline.passivity);
  EXPECT_TRUE(experiment.users[1].pipeline.passivity);
}

TEST(PrettyJson, ReadsBackToTheSameBits) {
  const boost::json::value value = boost::json::parse(
      R"({"a": [0.1, -3, 1e-300, 18446744073709551615], "b": {}, "c": [], "d": {"e": "\"\\", "f": [[true], null]}})");
  EXPECT_EQ(boost::json::parse(pretty_json(value)), value);
  EXPECT_EQ(pretty_json(boost::json::parse(R"({"x": [1.5, 2]})")), "{\n  \"x\": [1.5, 2]\n}\n");
}

TEST(PrettyJson, WritesNullForNonFiniteNumbers) {
  EXPECT_EQ(pretty_json(boost::json::value(std::numeric_limits<double>::quiet_NaN())), "null\n");
  EXPECT_EQ(pretty_json(boost::json::value(std::numeric_limits<double>::infinity())), "null\n");
}

}  // namespace
}  // namespace tandem::lab

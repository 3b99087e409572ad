// Tests trials on several threads: each trial runs once, a repeated study runs none, and its output has the same bytes.
#include "lab/results/trial_runner.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/results/study_report.hpp"
#include "lab/results/study_results.hpp"
#include "tests/lab/results/small_study.hpp"

namespace tandem::lab {
namespace {

TEST_F(Study, RunsEveryTrialOnceAndSecondTimeNone) {
  TrialRunner first(trials(), settings());
  EXPECT_EQ(first.size().trials, 8U);
  EXPECT_EQ(first.size().references, 4U) << "one a seed and stage, shared by delays; late-pose is the truth";
  EXPECT_EQ(first.size().done, 0U);
  EXPECT_NEAR(first.size().virtual_s, 12, 1e-9);
  std::size_t shown = 0;
  const auto results = first.run([&](std::size_t done, std::size_t reused) {
    EXPECT_EQ(done, ++shown);
    EXPECT_EQ(reused, 0U);
  });
  EXPECT_EQ(shown, 8U);
  EXPECT_EQ(reused(results), 0U);

  TrialRunner second(trials(), settings());
  EXPECT_EQ(second.size().done, 8U);
  EXPECT_EQ(second.size().references, 0U);
  EXPECT_EQ(second.size().virtual_s, 0);
  const auto again = second.run([](std::size_t, std::size_t) {});
  EXPECT_EQ(reused(again), 8U);
  EXPECT_EQ(pretty_json(study_json(again)), pretty_json(study_json(results)));
}

TEST_F(Study, AgainstTheTruthAloneRunsItOnceASeedAndLeavesOutWhatTheOwnStageWouldSay) {
  RunSettings alone = settings();
  alone.holds_against_own_stage = false;
  TrialRunner runner(trials(), alone);
  EXPECT_EQ(runner.size().references, 2U) << "one a seed";
  const auto results = runner.run([](std::size_t, std::size_t) {});
  const auto both = run(trials(), settings());
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_TRUE(results[i].row.at("contact_delay_error_rms_n").is_null());
    EXPECT_FALSE(both[i].row.at("contact_delay_error_rms_n").is_null());
    EXPECT_EQ(results[i].row.at("contact_error_rms_n"), both[i].row.at("contact_error_rms_n"));
  }
  EXPECT_EQ(reused(both), 0U) << "a row of the same folder that lacks a metric must not be reused";
}

TEST_F(Study, IsRefusedForATrialWithMoreHandsThanToolsWhoeverSharesItsScene) {
  std::vector<Trial> all = trials();
  ExperimentUser cleo = all.back().experiment.users.back();
  cleo.name = "cleo";
  all.back().experiment.users.push_back(cleo);
  try {
    const TrialRunner runner(std::move(all), settings());
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("3 manipulators, but the scene has 2 tools"), std::string::npos)
        << error.what();
  }
}

TEST_F(Study, ContinuesAnInterruptedStudy) {
  run(trials(), settings());
  std::size_t removed = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "out" / "trials")) {
    if (removed == 3) break;
    if (removed == 2) {
      std::ofstream(entry.path()) << "{\"key\": \"cut";  // a truncated file, as after a crash
    } else {
      fs::remove(entry.path());
    }
    ++removed;
  }
  EXPECT_EQ(reused(run(trials(), settings())), 5U);
}

TEST_F(Study, IsReproducibleForAnyNumberOfThreads) {
  RunSettings two = settings("two");
  two.threads = 2;
  const auto once = run(trials(), settings("one"));
  const auto again = run(trials(), settings("again"));
  const auto parallel = run(trials(), two);
  const std::string bytes = pretty_json(study_json(once));
  EXPECT_EQ(pretty_json(study_json(again)), bytes);
  EXPECT_EQ(pretty_json(study_json(parallel)), bytes);
  EXPECT_EQ(study_report(parallel).html(), study_report(once).html());
  EXPECT_EQ(study_csv(parallel), study_csv(once));
}

TEST_F(Study, AUserWhoCannotJoinIsAnOutcome) {
  GridRequest request;
  request.is_single = true;
  request.axes = {parse_axis("link.rtt_ms=15000")};
  const auto results = run(trials(request), settings());
  EXPECT_EQ(text_in(results.at(0).row, "outcome"), "not-joined");
  EXPECT_EQ(results.at(0).row.at("peak_force_n"), json::value(nullptr));
  EXPECT_TRUE(has_lost_users(results));
}

}  // namespace
}  // namespace tandem::lab

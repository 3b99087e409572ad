// Tests the output of a study: rows, time series, files for other programs, and the report. Tests when a study must run
// its trials again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/results/study_hdf5.hpp"
#include "lab/results/study_report.hpp"
#include "lab/results/study_results.hpp"
#include "tests/lab/results/small_study.hpp"

namespace tandem::lab {
namespace {

TEST_F(Study, ARowIsNotReusedIfAnInputChanged) {
  run(trials(), settings());
  RunSettings other_program = settings();
  other_program.program = "another build";
  EXPECT_EQ(reused(run(trials(), other_program)), 0U);
  std::ofstream(folder_ / "push.json") << R"({"points": [{"t_s": 0, "phase": "move"}]})";
  EXPECT_EQ(reused(run(trials(), settings())), 0U) << "another hand";
  std::string scene = kScene;
  scene.replace(scene.find("0.3"), 3, "0.4");
  std::ofstream(folder_ / "push_scene.json") << scene;
  EXPECT_EQ(reused(run(trials(), settings())), 0U) << "another mass";
}

TEST_F(Study, ARowContainsTheSettingsAndTheResults) {
  GridRequest request;
  request.axes.push_back(parse_axis("hand.mass_kg=0.5"));
  const auto results = run(trials(request), settings());
  const json::object& row = results.at(7).row;
  EXPECT_EQ(text_in(row, "experiment"), "small");
  EXPECT_EQ(text_in(row, "stage"), "hold");
  EXPECT_EQ(number_in(row, "rtt_ms"), 20);
  EXPECT_EQ(number_in(row, "loss"), 0.05);
  EXPECT_EQ(number_in(row, "seed"), 2);
  EXPECT_EQ(row.at("passivity"), json::value(false));
  EXPECT_EQ(pretty_json(row.at("overrides")), pretty_json(json::object{{"hand.mass_kg", 0.5}}));
  EXPECT_EQ(text_in(row, "outcome"), "completed");
  for (const TrialMetric& metric : trial_metrics()) EXPECT_TRUE(row.contains(metric.name)) << metric.name;
  EXPECT_GT(number_in(row, "contact_error_rms_n"), 0);
  EXPECT_EQ(row.at("felt_mass_ratio"), json::value(nullptr)) << "the path has no shaking phase";
  EXPECT_EQ(row.at("users").as_array().size(), 2U);
  EXPECT_EQ(seed_groups(results).size(), 4U);
}

TEST_F(Study, AtZeroDelayTheReferenceStageDoesNotErr) {
  GridRequest request;
  request.axes = {parse_axis("link.loss=0"), parse_axis("link.rtt_ms=0"), parse_axis("stage=" + truth_stage())};
  for (const TrialResult& result : run(trials(request), settings())) {
    EXPECT_EQ(number_in(result.row, "contact_error_rms_n"), 0);
    EXPECT_EQ(number_in(result.row, "free_drag_rms_n"), 0);
  }
}

TEST_F(Study, SamplesAreStoredOnRequest) {
  RunSettings with_samples = settings();
  with_samples.keeps_samples = true;
  const auto results = run(trials(), with_samples);
  for (const TrialResult& result : results) {
    for (const char* file : {"1-anna.csv", "2-ben.csv", "bodies.csv", "trial.json", "report.html"}) {
      EXPECT_TRUE(fs::is_regular_file(result.samples / file)) << result.samples / file;
    }
  }
  fs::remove_all(results.at(3).samples);
  EXPECT_EQ(reused(run(trials(), with_samples)), 7U) << "a trial whose samples are gone is run again";
  EXPECT_EQ(reused(run(trials(), settings())), 8U);
}

TEST_F(Study, IsWrittenForOtherPrograms) {
  RunSettings with_samples = settings();
  with_samples.keeps_samples = true;
  const auto results = run(trials(), with_samples);
  const fs::path file = folder_ / "results.h5";
  write_study_hdf5(file, results);
  std::ifstream in(file, std::ios::binary);
  char magic[4] = {};
  in.read(magic, sizeof magic);
  EXPECT_EQ(std::string(magic + 1, 3), "HDF");
  EXPECT_GT(fs::file_size(file), 8U * 2 * 100 * 8) << "the samples are in it";
  EXPECT_THROW(write_study_hdf5(folder_ / "no" / "folder.h5", results), std::runtime_error);

  const std::string csv = study_csv(results);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 9);
  EXPECT_THAT(csv, testing::StartsWith("experiment,stage,predictor,passivity,deadband,rtt_ms,jitter_ms,loss,seed,"));
}

TEST_F(Study, TheReportDefinesEveryMetricAndDrawsEveryStage) {
  const std::string html = study_report(run(trials(), settings())).html();
  for (const TrialMetric& metric : trial_metrics()) {
    EXPECT_THAT(html, testing::HasSubstr(std::string(metric.name))) << metric.name;
  }
  EXPECT_THAT(html, testing::HasSubstr("late-pose"));
  EXPECT_THAT(html, testing::HasSubstr("<svg"));
}

/// Returns the result of a trial with the fields that the report needs.
TrialResult trial_of(const char* stage, double rtt_ms, std::uint64_t seed, const json::object& more) {
  TrialResult result;
  result.row = {{"experiment", "e"},     {"stage", stage}, {"predictor", client::StageSettings{}.predictor},
                {"passivity", true},     {"deadband", 0},  {"rtt_ms", rtt_ms},
                {"jitter_ms", 0},        {"loss", 0},      {"seed", seed},
                {"outcome", "completed"}};
  for (const auto& [name, value] : more) result.row[name] = value;
  return result;
}

TEST(StudyReport, ItsHeadlineIsWhereTheFirstMetricIsDefined) {
  std::vector<TrialResult> results;
  for (const double rtt_ms : {0, 50, 100}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const bool is_defined = rtt_ms < 100 && !(rtt_ms == 50 && seed == 2);
      results.push_back(trial_of("hold", rtt_ms, seed,
                                 {{"path_error_of_peak", is_defined ? json::value(0.2) : json::value(nullptr)},
                                  {"contact_force_ratio", 0.9}}));
    }
  }
  const std::string html = study_report(results).html();
  EXPECT_THAT(html, testing::HasSubstr("At 50 ms round trip, path error of peak from best to worst: "));
  EXPECT_THAT(html, testing::HasSubstr("hold 20 % (2 of 3 trials)"));
  EXPECT_THAT(html, testing::HasSubstr("At 50 ms round trip: mean (least to greatest of the seeds)"));
  std::vector<TrialResult> two = results;
  two.push_back(trial_of("hold", 50, 1, {{"experiment", "f"}, {"path_error_of_peak", 0.4}}));
  EXPECT_THAT(study_report(two).html(),
              testing::HasSubstr("mean (least to greatest of the trials of all experiments)"));
}

TEST(StudyReport, TheLeastDisturbedLinkIsChosenByNumbers) {
  std::vector<TrialResult> results;
  for (const double rtt_ms : {0, 50}) {
    results.push_back(trial_of("hold", rtt_ms, 1, {{"loss", 0.2}, {"contact_force_ratio", 0.5}}));
    results.push_back(trial_of("hold", rtt_ms, 1, {{"jitter_ms", 12.5}, {"contact_force_ratio", 0.9}}));
  }
  EXPECT_THAT(study_report(results).html(), testing::HasSubstr("the experiment e (12.5 ms jitter)"));
}

TEST(StudyReport, ACurveHasTrialsThatDifferInDelayAndSeedOnly) {
  const std::string name = curve_of(trial_of("hold", 0, 1, {}).row);
  EXPECT_EQ(curve_of(trial_of("hold", 50, 2, {}).row), name);
  std::set<std::string> names{name};
  for (const json::object& other :
       {json::object{{"jitter_ms", 5}}, json::object{{"loss", 0.01}}, json::object{{"passivity", false}},
        json::object{{"overrides", json::object{{"hand.mass_kg", 0.5}}}}, json::object{{"stage", "wave"}}})
    EXPECT_TRUE(names.insert(curve_of(trial_of("hold", 0, 1, other).row)).second) << *names.rbegin();
}

TEST(StudyReport, BytesAreADataRate) {
  EXPECT_EQ(axis_of_metric("bytes_per_s").axis.label(), "data rate [kB/s]");
}

TEST(FieldKernel, CanBeForcedAndReleased) {
  docking::MolecularField::use_by_default("portable");
  EXPECT_EQ(docking::MolecularField::default_kernel(), "portable");
  EXPECT_THROW(docking::MolecularField::use_by_default("abacus"), std::invalid_argument);
  EXPECT_EQ(docking::MolecularField::default_kernel(), "portable");
  docking::MolecularField::use_by_default("");
  EXPECT_EQ(docking::MolecularField::default_kernel(), docking::MolecularField::available_kernels().front());
}

TEST(SeedGroup, MeansAndWorstOmitNullValues) {
  const auto row = [](std::uint64_t seed, const json::value& drag, const char* outcome) {
    TrialResult result;
    result.row = {
        {"experiment", "e"}, {"stage", "hold"}, {"seed", seed}, {"free_drag_rms_n", drag}, {"outcome", outcome}};
    return result;
  };
  const std::vector<TrialResult> results{row(1, 2, "completed"), row(2, 4, "dropped"), row(3, nullptr, "completed")};
  const auto groups = seed_groups(results);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(mean_of(groups[0], "free_drag_rms_n"), 3);
  EXPECT_EQ(worst_of(groups[0], "free_drag_rms_n"), 4);
  EXPECT_EQ(outcomes_of(groups[0]), "completed 2/dropped 1");
  EXPECT_TRUE(std::isnan(mean_of(groups[0], "peak_force_n")));
  EXPECT_TRUE(std::isnan(worst_of(groups[0], "peak_force_n")));
}

TEST(SeedGroup, KeepsTrialsWithALongSilenceApart) {
  std::vector<TrialResult> results(3);
  for (std::size_t i = 0; i < results.size(); ++i) {
    results[i].row = {{"experiment", "e"}, {"seed", i}, {"silence_max_ms", i == 1 ? 111 : 109}};
  }
  const auto groups = seed_groups(results);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].size(), 2U);
  EXPECT_TRUE(was_silent(*groups[1].front()));
}

}  // namespace
}  // namespace tandem::lab

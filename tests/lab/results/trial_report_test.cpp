#include "lab/results/trial_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace tandem::lab {
namespace {

using testing::HasSubstr;
using testing::Not;

TickSample tick(double time_s, double force_n) {
  TickSample sample;
  sample.time = from_seconds(time_s);
  sample.displayed_D.f.x() = force_n;
  sample.phase = 0;
  return sample;
}

SessionTrace small_trace(const std::string& user_name) {
  SessionTrace trace;
  UserTrace& user = trace.users.emplace_back();
  user.user.name = user_name;
  user.ticks = {tick(0, 0.5), tick(0.001, 0.75), tick(0.002, 1.25)};
  trace.body_names = {"table", "block"};
  trace.body_can_move = {false, true};
  trace.bodies = {{Duration{0}, {Pose{}, Pose{}}, -2.5}, {from_seconds(0.002), {Pose{}, Pose{}}, -3.5}};
  return trace;
}

Experiment small_experiment() {
  Experiment experiment;
  experiment.name = "small";
  experiment.scene = "small.json";
  experiment.duration = from_seconds(0.003);
  return experiment;
}

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

std::string trial_report_html(const Experiment& experiment, const SessionTrace& trace) {
  return trial_report(experiment, trace, nullptr).html();
}

TEST(TrialReport, ShowsSixFiguresAndOneMoreWhereThereIsAField) {
  SessionTrace trace = small_trace("anna");
  EXPECT_EQ(count_of(trial_report_html(small_experiment(), trace), "<svg"), 6U);
  trace.field_kernel = "portable";
  const std::string with_field = trial_report_html(small_experiment(), trace);
  EXPECT_EQ(count_of(with_field, "<svg"), 7U);
  EXPECT_THAT(with_field, HasSubstr("Lennard-Jones energy"));
}

TEST(TrialReport, ShowsBodiesThatMoveAndNoOthers) {
  const std::string html = trial_report_html(small_experiment(), small_trace("anna"));
  EXPECT_THAT(html, HasSubstr("block"));
  EXPECT_THAT(html, Not(HasSubstr("table</")));
}

TEST(TrialReport, LeavesOutTheFigureOfBodiesWhereNoneMoves) {
  SessionTrace trace = small_trace("anna");
  trace.body_can_move = {false, false};
  EXPECT_EQ(count_of(trial_report_html(small_experiment(), trace), "<svg"), 5U);
}

TEST(TrialReport, DrawsTheForceBesideThatOfTheReference) {
  const SessionTrace trace = small_trace("anna");
  const std::string html = trial_report(small_experiment(), trace, &trace).html();
  EXPECT_THAT(html, HasSubstr("anna, at zero delay"));
  EXPECT_THAT(html, HasSubstr("error against the same hands at zero delay is 0 %"));
}

TEST(TrialReport, PutsTheMetricsOfATraceIntoItsTable) {
  const std::string html = trial_report_html(small_experiment(), small_trace("anna"));
  EXPECT_THAT(html, HasSubstr("force_max_n"));
  EXPECT_THAT(html, HasSubstr(">1.25<"));
}

TEST(TrialReport, NamesLostUsersAndTheReasons) {
  SessionTrace trace = small_trace("anna");
  trace.users.front().stayed_connected = false;
  trace.users.front().why_disconnected = "the cable was pulled";
  EXPECT_THAT(trial_report_html(small_experiment(), trace), HasSubstr("lost: the cable was pulled"));
}

TEST(TrialReport, HoldsNoMarkupOfAUserAndNoLink) {
  const std::string html = trial_report_html(small_experiment(), small_trace("<script>alert(1)</script>"));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("http://")));
  EXPECT_THAT(html, Not(HasSubstr("https://")));
}

}  // namespace
}  // namespace tandem::lab

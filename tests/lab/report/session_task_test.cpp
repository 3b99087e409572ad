// Tests that a session which did not complete its task fails, even if its forces were good.
#include "lab/report/session_task.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace tandem::lab {
namespace {

/// Returns a user's run with ten ticks per second: "move" until 2 s, then "hold" until 6 s. The peg is at its target,
/// and the molecules are in contact.
ClientRun done_user(const std::string& name) {
  ClientRun run;
  run.name = name;
  run.watched_body = "peg";
  run.trace.phases = {{0, 2, "move"}, {2, 6, "hold"}};
  for (int i = 0; i < 80; ++i) {
    run.trace.time_s.push_back(0.1 * i);
    const bool is_held = i >= 30 && i < 60;
    run.trace.body_m[0].push_back(is_held ? 0.0604 : 0.3);
    run.trace.body_m[1].push_back(0);
    run.trace.body_m[2].push_back(is_held ? 0.0302 : 0.065);
    run.trace.energy_kj_per_mol.push_back(is_held ? -80 : 5);
  }
  return run;
}

SessionTask all_tasks() {
  return {.body = "peg", .place_W = Vec3(0.06, 0, 0.03), .within_m = 0.001, .rest_m = 0.0005, .energy_kj_per_mol = -40};
}

std::vector<std::string> failing(const ClientRun& user) {
  std::vector<std::string> claims;
  for (const Check& check : check_task({"peg", {done_user("anna"), user}}, all_tasks())) {
    if (!check.holds()) claims.push_back(check.scope + ": " + check.claim);
  }
  return claims;
}

TEST(SessionTask, HoldsWhereTheHandsDidIt) {
  EXPECT_EQ(failing(done_user("ben")), std::vector<std::string>());
  EXPECT_EQ(check_task({"peg", {done_user("anna"), done_user("ben")}}, all_tasks()).size(), 6U);
}

TEST(SessionTask, EachFailsForItsOwnFaultInAnyTickOfTheSettledHold) {
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, std::function<void(ClientRun&)>>> faults = {
      {"ben: task: peg at (60.0, 0.0, 30.0) mm", [](ClientRun& u) { u.trace.body_m[2].assign(80, 0.065); }},
      {"ben: task: molecules in contact", [](ClientRun& u) { u.trace.energy_kj_per_mol[59] = -39; }},
      {"ben: task: molecules in contact", [](ClientRun& u) { u.trace.energy_kj_per_mol[30] = kNotANumber; }},
      {"ben: task: peg at rest", [](ClientRun& u) { u.trace.body_m[1][40] = 0.0006; }},
  };
  for (const auto& [claim, make] : faults) {
    ClientRun user = done_user("ben");
    make(user);
    const auto claims = failing(user);
    ASSERT_EQ(claims.size(), 1U) << claim;
    EXPECT_NE(claims[0].find(claim), std::string::npos) << claims[0];
  }
}

TEST(SessionTask, FailsWithoutData) {
  ClientRun user = done_user("ben");
  user.trace.phases.clear();
  EXPECT_EQ(failing(user).size(), 3U) << "without a phase hold there is no tick to look at";
  user = done_user("ben");
  user.trace.body_m[0].assign(80, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(failing(user).size(), 2U) << "no body was seen";
}

TEST(SessionTask, IsOfTheBodyThatTheUserWatched) {
  ClientRun user = done_user("ben");
  user.watched_body = "table";
  EXPECT_THROW(failing(user), std::invalid_argument);
}

TEST(SessionTask, IsReadFromAFileThatIsChecked) {
  const SessionTasks tasks = parse_session_tasks(
      R"({"peg_in_hole": {"body": "peg", "place_m": [0.06, 0, 0.03], "within_m": 0.001},
          "docking": {"rest_m": 0.002, "energy_kj_per_mol": -20}})",
      "tasks.json");
  EXPECT_EQ(tasks.size(), 2U);
  EXPECT_EQ(tasks.at("peg_in_hole").place_W, Vec3(0.06, 0, 0.03));
  EXPECT_EQ(tasks.at("peg_in_hole").rest_m, std::nullopt);
  EXPECT_EQ(tasks.at("docking").energy_kj_per_mol, -20);
  for (const char* const bad :
       {R"({"a": {"place_m": [0, 0, 0]}})", R"({"a": {"place_m": [0, 0], "within_m": 1}})", R"({"a": {"rest_m": -1}})",
        R"({"a": {"resting": 1}})", R"({"a": 3})", R"([1])", "", R"({"a": {"energy_kj_per_mol": "low"}})"}) {
    EXPECT_THROW(parse_session_tasks(bad, "tasks.json"), std::invalid_argument) << bad;
  }
}

}  // namespace
}  // namespace tandem::lab

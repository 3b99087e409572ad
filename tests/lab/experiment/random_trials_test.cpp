// Tests that random trials lie within their ranges and are reproducible for a seed, and that each bound on their
// results can fail.
#include "lab/experiment/random_trials.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/json_pretty.hpp"
#include "lab/results/random_claims.hpp"

namespace tandem::lab {
namespace {

TEST(RandomTrials, LieInTheirRanges) {
  std::set<std::string> experiments;
  int with_errors = 0, correlated = 0, with_path = 0;
  constexpr int kCount = 200;
  for (const Trial& trial : random_trials(kCount, 7)) {
    const Experiment& experiment = trial.experiment;
    experiments.insert(experiment.name);
    EXPECT_GE(round_trip_of(experiment.users[0]), from_seconds(0.0199));
    EXPECT_LE(round_trip_of(experiment.users[0]), from_seconds(0.2001));
    EXPECT_LE(experiment.users[0].up.loss, 0.05);
    const double mass_scale = experiment.users[0].pipeline.model.mass_scale;
    EXPECT_LE(std::abs(mass_scale - 1), 0.15);
    with_errors += mass_scale != 1;
    correlated += trial.settings.contains("link.jitter_correlation_ms");
    with_path += trial.settings.contains("link.delay_path");
    for (const ExperimentUser& user : experiment.users) {
      const devices::HandParameters& hand = user.hand_parameters;
      EXPECT_GE(hand.mass_kg, 0.1);
      EXPECT_LE(hand.mass_kg, 1);
      const double ratio = hand.damping_n_s_per_m / (2 * std::sqrt(hand.stiffness_n_per_m * hand.mass_kg));
      EXPECT_GT(ratio, 0.349);
      EXPECT_LT(ratio, 0.801);
      EXPECT_GE(user.pace, 0.75);
      EXPECT_LE(user.pace, 1.3);
      EXPECT_LE(user.hand.length(), experiment.duration + from_seconds(0.02)) << experiment.name;
    }
  }
  EXPECT_EQ(experiments.size(), contact_cases().size());
  EXPECT_NEAR(with_errors, 0.5 * kCount, 30);
  EXPECT_NEAR(correlated, 0.3 * kCount, 30);
  EXPECT_NEAR(with_path, 0.3 * kCount, 30);
}

TEST(RandomTrials, AreTheSameForTheSameSeedAndGoOnWhereFewerEnd) {
  const std::vector<Trial> few = random_trials(5, 3), more = random_trials(8, 3), others = random_trials(5, 4);
  for (std::size_t i = 0; i < few.size(); ++i) {
    EXPECT_EQ(compact_json(few[i].settings), compact_json(more[i].settings));
    EXPECT_NE(compact_json(few[i].settings), compact_json(others[i].settings));
  }
}

RandomOutcome outcome(const char* experiment, const char* text, double step, double energy_j, double error,
                      double silence_ms = 20) {
  return {{{"experiment", experiment},
           {"seed", 1},
           {"outcome", text},
           {"force_step_max_n_per_ms", step},
           {"energy_created_in_100_ms_j", energy_j},
           {"path_error_of_peak", error},
           {"silence_max_ms", silence_ms}},
          true};
}

std::vector<bool> held(const std::vector<RandomOutcome>& outcomes) {
  std::vector<bool> held;
  for (const RandomClaim& claim : random_claims(outcomes)) held.push_back(claim.holds());
  return held;
}

/// Returns outcomes that satisfy all claims, with at least one trial for each claim.
std::vector<RandomOutcome> good_outcomes() {
  std::vector<RandomOutcome> outcomes;
  for (const char* const experiment : {"wall", "soft", "three_hands", "four_hands"})
    outcomes.push_back(outcome(experiment, "completed", 0.1, 0.001, 0.02));
  return outcomes;
}

TEST(RandomClaims, HoldWhereNothingIsBeyondABoundAndEachCanFail) {
  EXPECT_EQ(held(good_outcomes()), (std::vector<bool>(8, true)));
  const auto fails = [&](const RandomOutcome& bad, std::vector<std::size_t> which) {
    std::vector<bool> expected(8, true);
    for (const std::size_t i : which) expected[i] = false;
    std::vector<RandomOutcome> outcomes = good_outcomes();
    const auto same = std::ranges::find_if(
        outcomes, [&](const RandomOutcome& good) { return good.row.at("experiment") == bad.row.at("experiment"); });
    (same == outcomes.end() ? outcomes.front() : *same) = bad;
    EXPECT_EQ(held(outcomes), expected);
  };
  fails(outcome("squeeze", "dropped", 0.1, 0.001, 0.02), {0});
  fails(outcome("wall", "completed", 0.6, 0.001, 0.02), {1});
  fails(outcome("wall", "completed", 0.1, 0.03, 0.02), {2});
  fails(outcome("wall", "completed", 0.1, 0.07, 0.02), {2, 3});
  fails(outcome("wall", "completed", 0.1, 0.001, 0.05), {4});
  fails(outcome("soft", "completed", 0.1, 0.001, 0.09), {5});
  fails(outcome("three_hands", "completed", 0.1, 0.001, 0.09), {6});
  fails(outcome("four_hands", "completed", 0.1, 0.001, 0.19), {7});
}

TEST(RandomClaims, DoNotHoldWhereNothingWasMeasured) {
  EXPECT_EQ(held({}), (std::vector<bool>(8, false)));
  EXPECT_EQ(held({outcome("soft", "completed", 0.1, 0.001, 0.02)}),
            (std::vector<bool>{true, true, true, true, false, true, false, false}));
  // The link of this trial is silent for 200 ms. The trial must not count in any claim, because the displayed force
  // decays during such a silence.
  EXPECT_EQ(held({outcome("soft", "completed", 0.1, 0.001, 0.02, 200)}), (std::vector<bool>(8, false)));
  for (const RandomClaim& claim : random_claims(good_outcomes())) EXPECT_GT(claim.trials, 0U) << claim.text;
}

TEST(RandomClaims, LeaveOutSilencesAndWhatZeroDelayDropsToo) {
  std::vector<RandomOutcome> outcomes = good_outcomes();
  RandomOutcome dropped = outcome("squeeze", "dropped", 0.1, 0.001, 0.02);
  dropped.truth_succeeds = false;
  outcomes.push_back(dropped);
  outcomes.push_back(outcome("squeeze", "dropped", 3, 1, 1, 200));
  EXPECT_EQ(held(outcomes), (std::vector<bool>(8, true)));
}

}  // namespace
}  // namespace tandem::lab

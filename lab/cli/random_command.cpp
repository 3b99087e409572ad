// `tandem-lab random`: runs trials under random conditions and checks the results against bounds.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "lab/cli/commands.hpp"
#include "lab/experiment/random_trials.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/random_claims.hpp"
#include "lab/results/study_results.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {
namespace {

struct RandomOptions {
  std::string out;
  std::size_t trials = 60;
  std::uint64_t seed = 1;
  std::size_t threads = 0;
  std::vector<std::size_t> only;
  std::vector<std::string> experiments;

  bool is_selection() const { return !only.empty() || !experiments.empty(); }
};

struct NumberedTrial {
  std::size_t number = 0;  ///< index of the trial in random_trials()
  Trial trial;
};

std::vector<NumberedTrial> selected_trials(const RandomOptions& options) {
  const std::size_t count = options.only.empty() ? options.trials : std::ranges::max(options.only) + 1;
  std::vector<Trial> all = random_trials(count, options.seed);
  std::vector<NumberedTrial> selected;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_requested = options.only.empty() || std::ranges::count(options.only, i) > 0;
    const bool is_of =
        options.experiments.empty() || std::ranges::count(options.experiments, all[i].experiment.name) > 0;
    if (is_requested && is_of) selected.push_back({i, std::move(all[i])});
  }
  if (selected.empty()) {
    throw std::invalid_argument("none of the first " + std::to_string(count) +
                                " trials is chosen by --only and --experiment; use more --trials");
  }
  return selected;
}

std::vector<Trial> trials_of(const std::vector<NumberedTrial>& selected) {
  std::vector<Trial> trials;
  for (const NumberedTrial& each : selected) trials.push_back(each.trial);
  return trials;
}

/// Runs the trials. A time series with one row per millisecond is stored only for trials that the user selected by
/// number, and for their reference trials.
std::vector<TrialResult> run_trials(std::vector<Trial> trials, const RandomOptions& options) {
  RunSettings settings;
  settings.out = options.out;
  settings.keeps_samples = !options.only.empty();
  if (settings.keeps_samples) {
    for (Trial& trial : trials) trial.experiment.sample_period = std::chrono::milliseconds(1);
  }
  settings.threads = options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  settings.holds_against_own_stage = false;
  settings.program = program_fingerprint();
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  TrialRunner runner(std::move(trials), settings, loading);
  return runner.run([&](std::size_t done, std::size_t) {
    if (done % 10 == 0) std::cerr << "tandem-lab: " << done << " trials done\n";
  });
}

bool succeeds(const TrialResult& result) {
  return text_in(result.row, "outcome") == "completed";
}

/// Evaluates the trials. For a trial that did not succeed, and for a trial with stored time series, the reference at
/// zero delay is run as well.
std::vector<RandomOutcome> outcomes_of(const std::vector<NumberedTrial>& trials,
                                       const std::vector<TrialResult>& results, const RandomOptions& options) {
  std::vector<RandomOutcome> outcomes;
  std::vector<Trial> truths;
  const auto needs_truth = [&](const TrialResult& result) { return !options.only.empty() || !succeeds(result); };
  for (std::size_t i = 0; i < results.size(); ++i) {
    outcomes.push_back({results[i].row, true, trials[i].number});
    if (needs_truth(results[i])) truths.push_back(reference_of(trials[i].trial));
  }
  if (truths.empty()) return outcomes;
  const std::vector<TrialResult> at_zero_delay = run_trials(truths, options);
  std::size_t next = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!needs_truth(results[i])) continue;
    const TrialResult& truth = at_zero_delay.at(next++);
    outcomes[i].truth_succeeds = succeeds(truth);
    if (options.only.empty()) continue;
    std::cout << "trial " << trials[i].number << ": time series in " << results[i].samples.string()
              << ", at zero delay in " << truth.samples.string() << '\n';
  }
  return outcomes;
}

void print_claim(const RandomClaim& claim) {
  std::cout << (claim.holds()         ? "  ok      "
                : claim.is_measured() ? "  FAILED  "
                                      : "  none    ")
            << std::left << std::setw(68) << claim.text << std::right << std::setw(9) << std::setprecision(3)
            << claim.value << "  <= " << std::left << std::setw(5) << claim.bound << " of " << claim.trials
            << std::right << (claim.worst.empty() ? "" : " (" + claim.worst + ")") << '\n';
}

int run_random(const RandomOptions& options) {
  const std::filesystem::path folder = made_folder(options.out);
  const std::vector<NumberedTrial> trials = selected_trials(options);
  const std::vector<TrialResult> results = run_trials(trials_of(trials), options);
  const std::vector<RandomClaim> claims = random_claims(outcomes_of(trials, results, options));
  write_text_file(folder / "results.json", pretty_json(study_json(results)));
  write_text_file(folder / "results.csv", study_csv(results));
  const auto silent = std::ranges::count_if(results, [](const TrialResult& result) { return was_silent(result.row); });
  std::cout << results.size() << " random trials from seed " << options.seed << ", " << silent
            << " with a silence above 110 ms; files in " << folder.string() << '\n';
  bool holds = true;
  for (const RandomClaim& claim : claims) {
    if (options.is_selection() && !claim.is_measured()) continue;
    holds = holds && claim.holds();
    print_claim(claim);
  }
  return holds && !has_lost_users(results) ? 0 : 1;
}

}  // namespace

void add_random_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RandomOptions>();
  CLI::App* command = app.add_subcommand(
      "random",
      "Runs shipped cases of contact with random hands, couplings, links and model errors, and checks bounds");
  command
      ->add_option("--out", options->out,
                   "folder for results.json and results.csv; trials in it from an earlier run are not run again")
      ->required();
  command->add_option("--trials", options->trials, "how many, 1 to 2000 [60]")
      ->check(CLI::Range(1, 2000).description(""));
  command->add_option("--seed", options->seed, "of all random numbers [1]")
      ->check(CLI::NonNegativeNumber.description(""));
  command
      ->add_option("--only", options->only,
                   "only the trials of these numbers, from 0, as results name them; keeps their time series and those "
                   "of the same hands at zero delay")
      ->check(CLI::Range(0, 1999).description(""));
  command->add_option("--experiment", options->experiments, "only the trials of these experiments")
      ->check(CLI::IsMember(contact_cases()).description(""));
  command->add_option("--threads", options->threads, "trials at a time, 1 to 256 [default: as many as there are cores]")
      ->check(CLI::Range(1, 256).description(""));
  command->footer(
      "Exit code: 0 every bound holds, 1 one does not, or no trial measured it, or a user lost its connection, 2 bad "
      "input or set-up. With --only or --experiment, bounds without a trial are left out.");
  command->callback([options, &exit_code] { exit_code = run_random(*options); });
}

}  // namespace tandem::lab

// `tandem-lab random`: trials under random conditions, held against bounds.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
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
};

std::vector<TrialResult> run_trials(std::vector<Trial> trials, const RandomOptions& options) {
  RunSettings settings;
  settings.out = options.out;
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

/// The truth is run only for trials that did not succeed.
std::vector<RandomOutcome> outcomes_of(const std::vector<Trial>& trials, std::vector<TrialResult>& results,
                                       const RandomOptions& options) {
  std::vector<RandomOutcome> outcomes;
  std::vector<Trial> truths;
  for (std::size_t i = 0; i < results.size(); ++i) {
    outcomes.push_back({results[i].row, true});
    if (!succeeds(results[i])) truths.push_back(reference_of(trials[i]));
  }
  if (truths.empty()) return outcomes;
  const std::vector<TrialResult> at_zero_delay = run_trials(truths, options);
  std::size_t next = 0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!succeeds(results[i])) outcomes[i].truth_succeeds = succeeds(at_zero_delay.at(next++));
  }
  return outcomes;
}

int run_random(const RandomOptions& options) {
  const std::filesystem::path folder = made_folder(options.out);
  const std::vector<Trial> trials = random_trials(options.trials, options.seed);
  std::vector<TrialResult> results = run_trials(trials, options);
  const std::vector<RandomClaim> claims = random_claims(outcomes_of(trials, results, options));
  write_text_file(folder / "results.json", pretty_json(study_json(results)));
  write_text_file(folder / "results.csv", study_csv(results));
  const auto silent = std::ranges::count_if(results, [](const TrialResult& result) { return was_silent(result.row); });
  std::cout << results.size() << " random trials from seed " << options.seed << ", " << silent
            << " with a silence above 110 ms; files in " << folder.string() << '\n';
  bool holds = true;
  for (const RandomClaim& claim : claims) {
    holds = holds && claim.holds();
    std::cout << (std::isnan(claim.value) ? "  none    "
                  : claim.holds()         ? "  ok      "
                                          : "  FAILED  ")
              << std::left << std::setw(68) << claim.text << std::right << std::setw(9) << std::setprecision(3)
              << claim.value << "  <= " << claim.bound << (claim.worst.empty() ? "" : "  (" + claim.worst + ")")
              << '\n';
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
  command->add_option("--threads", options->threads, "trials at a time, 1 to 256 [default: as many as there are cores]")
      ->check(CLI::Range(1, 256).description(""));
  command->footer(
      "Exit code: 0 every bound holds, 1 one does not, or a user lost its connection, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_random(*options); });
}

}  // namespace tandem::lab

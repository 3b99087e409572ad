// `tandem-lab run`: one trial of an experiment file, in virtual time.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/stage.hpp"
#include "client/trace.hpp"
#include "common/json/pretty.hpp"
#include "common/progress.hpp"
#include "lab/commands.hpp"
#include "lab/experiment.hpp"
#include "lab/output_folder.hpp"
#include "lab/results.hpp"
#include "lab/trial_report.hpp"
#include "lab/virtual_session.hpp"

namespace tandem::lab {
namespace {

struct Options {
  std::string experiment;
  std::string out;
  std::optional<std::uint64_t> seed;
  std::string stage;
  bool wants_json = false;
};

// File names are made of user names, which may hold anything.
std::string file_name(const std::string& user_name, std::size_t index) {
  std::string result;
  for (const char c : user_name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    result += is_plain ? c : '_';
  }
  return std::to_string(index + 1) + "-" + result + ".csv";
}

std::vector<std::unique_ptr<TraceWriter>> open_traces(const Experiment& experiment,
                                                      const std::filesystem::path& folder) {
  const auto every = static_cast<std::uint64_t>(experiment.sample_period / kHapticPeriod);
  std::vector<std::unique_ptr<TraceWriter>> traces;
  for (std::size_t i = 0; i < experiment.users.size(); ++i) {
    traces.push_back(std::make_unique<TraceWriter>(folder / file_name(experiment.users[i].name, i), every));
  }
  return traces;
}

Experiment experiment_of(const Options& options) {
  Experiment experiment = load_experiment(options.experiment);
  if (options.seed) experiment.seed = *options.seed;
  if (!options.stage.empty() && make_stage(options.stage) == nullptr) {
    throw std::invalid_argument("--stage " + options.stage + ": does not exist; use one of: " + listed_stage_names());
  }
  for (ExperimentUser& user : experiment.users) {
    if (!options.stage.empty()) user.stage = options.stage;
  }
  return experiment;
}

int run(const Options& options) {
  const Experiment experiment = experiment_of(options);
  SceneLoading loading;
  loading.progress = progress_on_stderr();
  VirtualSession session(experiment, load_scene(experiment.scene, loading));
  const std::filesystem::path folder = made_folder(options.out);
  auto traces = open_traces(experiment, folder);
  session.on_tick = [&](std::size_t user, const TickRecord& record, int phase) { traces[user]->write(record, phase); };
  const SteadyClock wall;
  const LocalTime begin = wall.now();
  const SessionTrace trace = session.run();
  const Timing timing{to_seconds(trace.joined_after + experiment.duration), to_seconds(wall.now() - begin)};

  const boost::json::object results = results_json(experiment, trace);
  write_text_file(folder / "results.json", pretty_json(results));
  write_text_file(folder / "timing.json", pretty_json(timing_json(timing)));
  write_text_file(folder / "bodies.csv", bodies_csv(trace));
  write_text_file(folder / "report.html", trial_report_html(experiment, trace));
  for (const auto& writer : traces) {
    if (!writer->flush())
      throw std::runtime_error(folder.string() + ": a trace could not be written; is the disk full?");
  }
  if (options.wants_json) {
    std::cout << pretty_json(results);
  } else {
    print_summary(std::cout, experiment, trace, timing);
  }
  return is_complete(trace) ? 0 : 1;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("run", "Runs one trial of an experiment in virtual time");
  command->add_option("experiment", options->experiment, "experiment file (JSON; fields in lab/README.md)")->required();
  command->add_option("--out", options->out, "folder for results.json, timing.json, report.html and the CSV files")
      ->required();
  command->add_option("--seed", options->seed, "instead of the file's seed");
  command->add_option("--stage", options->stage, "for all users, instead of the file's: " + listed_stage_names());
  command->add_flag("--json", options->wants_json, "print results.json instead of a table");
  command->footer("Exit code: 0 done, 1 a user lost its connection during the trial, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tandem::lab

// `tandem-lab run`: runs the trials of experiment files in virtual time.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/commands.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "lab/experiment/trial_grid.hpp"
#include "lab/results/output_files.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/study_hdf5.hpp"
#include "lab/results/study_report.hpp"
#include "lab/results/study_results.hpp"
#include "lab/results/trial_runner.hpp"

namespace tandem::lab {
namespace {

/// Typical speed of studies on one core, as a multiple of real time. It serves only for the estimate of the duration
/// before the first trial has run.
constexpr double kExpectedSpeed = 10;

struct RunOptions {
  std::vector<std::string> experiments;
  std::string out;
  std::optional<std::uint64_t> seed;
  std::optional<std::uint64_t> seeds;
  std::vector<std::string> settings;
  std::string stage;
  std::string kernel;
  std::size_t threads = 0;
  bool is_single = false;
  bool is_full = false;
  bool keeps_samples = false;
  bool prints_json = false;
  bool is_dry = false;
  bool against_truth_alone = false;
};

Axis stage_axis(const std::string& names) {
  const std::vector<std::string_view> known = known_stages();
  Axis axis = parse_axis("stage=" + names);
  for (const boost::json::value& value : axis.values) {
    const std::string name = value.is_string() ? std::string(value.get_string()) : "";
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw std::invalid_argument("--stage " + names + ": does not exist; use one or more of: " + listed_stages());
  }
  return axis;
}

GridRequest request_of(const RunOptions& options) {
  GridRequest request;
  request.is_single = options.is_single;
  request.is_full = options.is_full;
  request.seeds = options.seeds;
  if (options.seed) request.axes.push_back({"seed", {*options.seed}});
  if (!options.stage.empty()) request.axes.push_back(stage_axis(options.stage));
  for (const std::string& setting : options.settings) request.axes.push_back(parse_axis(setting));
  return request;
}

std::vector<Trial> trials_of_run(const RunOptions& options) {
  const GridRequest request = request_of(options);
  std::vector<Trial> trials;
  for (const std::filesystem::path& file : experiment_files(options.experiments)) {
    for (Trial& trial : expand(read_experiment_file(file), request)) trials.push_back(std::move(trial));
  }
  if (trials.empty()) throw std::invalid_argument("there is nothing to run; the grid has no trial");
  return trials;
}

std::string time_text(double seconds) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(seconds < 600 ? 0 : 1);
  if (seconds < 120) {
    text << seconds << " s";
  } else {
    text << seconds / 60 << " min";
  }
  return text.str();
}

/// Displays the progress of a study: as a bar on a terminal, otherwise as occasional lines.
class StudyLine {
 public:
  explicit StudyLine(std::size_t total) : total_(total) {}

  void show(std::size_t done, std::size_t reused) {
    constexpr std::size_t kWidth = 30;
    const std::size_t filled = kWidth * done / total_;
    const std::size_t run = done - reused;
    const double wall_s = to_seconds(clock_.now() - begin_);
    const double left_s = run == 0 ? 0 : wall_s * static_cast<double>(total_ - done) / static_cast<double>(run);
    std::ostringstream line;
    line << '[' << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] " << done << '/' << total_
         << " trials, " << time_text(left_s) << " left";
    const bool is_end = done == total_;
    if (is_terminal_) {
      std::cerr << '\r' << line.str() << "    " << (is_end ? "\n" : "") << std::flush;
    } else if (is_end || filled >= last_shown_ + kWidth / 5) {
      std::cerr << line.str() << '\n';
      last_shown_ = filled;
    }
  }

 private:
  std::size_t total_;
  SteadyClock clock_;
  LocalTime begin_ = clock_.now();
  bool is_terminal_ = isatty(STDERR_FILENO) != 0;
  std::size_t last_shown_ = 0;
};

void print_size(const StudySize& size, std::size_t threads) {
  threads = std::min(threads, std::max<std::size_t>(1, size.trials));
  std::cerr << size.trials << (size.trials == 1 ? " trial" : " trials");
  if (size.done > 0) std::cerr << ", " << size.done << " of them done already";
  if (size.references > 0) std::cerr << ", and " << size.references << " at zero delay to hold them against";
  std::cerr << "; about " << time_text(size.virtual_s / kExpectedSpeed / static_cast<double>(threads)) << " on "
            << threads << (threads == 1 ? " core\n" : " cores\n");
}

void write_results(const std::filesystem::path& folder, std::span<const TrialResult> results, double wall_s,
                   bool is_one_with_files) {
  std::map<std::string, std::string> files{{"results.json", pretty_json(study_json(results))},
                                           {"results.csv", study_csv(results)}};
  // The report of a single trial shows its forces over time. A study report of one trial would contain curves with a
  // single point.
  if (!is_one_with_files) files = with_report(std::move(files), study_report(results));
  files["timing.json"] = pretty_json(study_timing_json(results, wall_s));
  write_all_files(folder.string(), files);
  write_study_hdf5(folder / "results.h5", results);
}

/// Prints notes that the table of results does not contain: the reasons why users could not join, and the number of
/// stored trials of earlier runs, which are not part of these results.
void print_notes(const std::filesystem::path& folder, std::span<const TrialResult> results) {
  std::set<std::string> here, reasons;
  for (const TrialResult& result : results) {
    here.insert(result.key + ".json");
    if (const std::string why = text_in(result.row, "why"); !why.empty()) reasons.insert(why);
  }
  for (const std::string& why : reasons) std::cerr << "tandem-lab: not joined: " << why << '\n';
  const std::filesystem::directory_iterator kept(folder / "trials");
  const auto others = std::count_if(begin(kept), end(kept), [&](const std::filesystem::directory_entry& entry) {
    return !here.contains(entry.path().filename().string());
  });
  if (others == 0) return;
  std::cerr << "tandem-lab: " << (folder / "trials").string() << " keeps " << others
            << (others == 1 ? " trial" : " trials") << " of earlier runs, which these results are without\n";
}

int run_run(const RunOptions& options) {
  if (!options.kernel.empty()) docking::MolecularField::use_by_default(options.kernel);
  std::vector<Trial> trials = trials_of_run(options);
  RunSettings settings;
  settings.out = options.out;
  settings.threads = options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  settings.samples_lie_in_out = trials.size() == 1;
  settings.keeps_samples = options.keeps_samples || settings.samples_lie_in_out;
  settings.holds_against_own_stage = !options.against_truth_alone;
  settings.program = program_fingerprint() + options.kernel;
  const bool is_one_with_files = settings.samples_lie_in_out;
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  TrialRunner runner(std::move(trials), settings, loading);
  const StudySize size = runner.size();
  print_size(size, settings.threads);
  if (options.is_dry) return 0;

  const std::filesystem::path folder = made_folder(options.out);
  StudyLine line(size.trials);
  const SteadyClock wall;
  const LocalTime begin = wall.now();
  const std::vector<TrialResult> results =
      runner.run([&](std::size_t done, std::size_t reused) { line.show(done, reused); });
  const double wall_s = to_seconds(wall.now() - begin);
  write_results(folder, results, wall_s, is_one_with_files);
  if (options.prints_json) {
    std::cout << pretty_json(study_json(results));
  } else {
    print_study(std::cout, results);
    std::cout << "\n"
              << results.size() << (results.size() == 1 ? " trial in " : " trials in ") << time_text(wall_s)
              << "; files in " << folder.string() << '\n';
  }
  print_notes(folder, results);
  return has_lost_users(results) ? 1 : 0;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Runs the trials of experiments in virtual time");
  command->add_option("experiment", options->experiments,
                      "experiment files (JSON; fields in lab/EXPERIMENTS.md), or names of shipped ones; none: all of "
                      "these");
  command
      ->add_option("--out", options->out,
                   "folder for results.json, results.csv, results.h5, report.html and timing.json; trials in it from "
                   "an earlier run are not run again, and the results contain only this run's trials")
      ->required();
  command->add_option("--set", options->settings,
                      "a quantity with its value, or with several to try: link.rtt_ms=0,50,100, hand.mass_kg=0.5, "
                      "users.1.device=falcon, scene.bodies.cube.friction=0.5; may be repeated");
  command->add_option("--seeds", options->seeds, "how many seeds, from the file's on: 1 to 1000")
      ->check(CLI::Range(1, 1000).description(""));
  command->add_option("--seed", options->seed, "the first seed, instead of the file's")
      ->check(CLI::NonNegativeNumber.description(""));
  command->add_option("--stage", options->stage, "as --set stage=: one or more of " + listed_stages());
  auto* single = command->add_flag("--single", options->is_single, "run the file without its grid");
  command
      ->add_flag("--full", options->is_full,
                 "every stage with every predictor, passivity on and off, delay, jitter and loss")
      ->excludes(single);
  command->add_flag("--samples", options->keeps_samples, "keep the time series of every trial; of a single one always");
  command->add_option("--kernel", options->kernel,
                      "of the molecular field, instead of the widest that this CPU has: \"portable\" gives the same "
                      "bytes on every x86-64");
  command->add_option("--threads", options->threads, "trials at a time, 1 to 256 [default: as many as there are cores]")
      ->check(CLI::Range(1, 256).description(""));
  command->add_flag("--truth-alone", options->against_truth_alone,
                    "hold trials against the server's own touch alone, not also against their own stage at zero delay: "
                    "a third less to run, and contact_delay_error_rms_n is null");
  command->add_flag("--dry", options->is_dry, "only print the number of trials and how long they may take");
  command->add_flag("--json", options->prints_json, "print results.json instead of a table");
  command->footer("Exit code: 0 done, 1 a user could not join, or lost its connection, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_run(*options); });
}

}  // namespace tandem::lab

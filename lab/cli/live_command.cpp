// `tandem-lab live`: runs the trials of an experiment file in real time over sockets and compares them with the same
// trials in virtual time. The comparison checks that results of the lab hold for the real client.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "lab/cli/commands.hpp"
#include "lab/experiment/experiment_library.hpp"
#include "lab/experiment/trial_grid.hpp"
#include "lab/metrics/trial_metrics.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/study_hdf5.hpp"
#include "lab/results/study_report.hpp"
#include "lab/results/study_results.hpp"
#include "lab/results/trial_files.hpp"
#include "lab/results/trial_report.hpp"
#include "lab/results/trial_runner.hpp"
#include "lab/session/live_session.hpp"
#include "lab/session/virtual_session.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

/// A metric that is compared between a live and a virtual trial. The permitted difference is the larger of `allowed`
/// and the fraction kAllowedShare of the virtual value. Both bounds are our choice. They are wide, because the
/// comparison should detect a component that fails in one of the two trials, not small deviations.
struct Compared {
  std::string_view metric;
  const char* what;
  const char* unit;
  double allowed = 0;  ///< permitted absolute difference
};
constexpr double kAllowedShare = 0.15;
constexpr std::array kCompared{Compared{"free_drag_rms_n", "drag", "N", 0.05},
                               Compared{"contact_error_rms_n", "contact force error", "N", 0.05},
                               Compared{"felt_stiffness_ratio", "felt stiffness ratio", "", 0}};

struct Comparison {
  const Compared* compared = nullptr;
  double live = 0;
  double virtual_value = 0;

  Check check(const std::string& scope) const {
    return {scope,
            std::string("difference of ") + compared->what,
            std::abs(live - virtual_value),
            Relation::kAtMost,
            allowed(),
            compared->unit,
            3};
  }
  double allowed() const { return std::max(compared->allowed, kAllowedShare * std::abs(virtual_value)); }
  /// Returns false if neither trial has a value that could be compared.
  bool is_possible() const { return !std::isnan(live) || !std::isnan(virtual_value); }
  bool agrees() const { return std::abs(live - virtual_value) <= allowed(); }
};

struct LiveResult {
  TrialResult live;
  TrialResult beside;
  std::vector<Comparison> comparisons;
  LiveTiming timing;
};

struct LiveOptions {
  std::string experiment;
  std::string out;
  std::vector<std::string> settings;
  std::string stage;
  std::optional<std::uint64_t> seeds;
  int realtime_priority = 0;
  bool is_single = false;
  bool prints_json = false;
};

std::vector<Trial> trials_of_live(const LiveOptions& options) {
  GridRequest request;
  request.is_single = options.is_single;
  request.seeds = options.seeds;
  if (!options.stage.empty()) request.axes.push_back(parse_axis("stage=" + options.stage));
  for (const std::string& setting : options.settings) request.axes.push_back(parse_axis(setting));
  const std::vector<std::string> names{options.experiment};
  return expand(read_experiment_file(experiment_files(names).front()), request);
}

/// Cache of virtual runs at zero delay. Each run is computed only once.
class References {
 public:
  /// Returns the trace of a virtual run at zero delay. It is computed at the first request.
  /// In      at_zero_delay  result of reference_of() or same_stage_of() for a trial
  const SessionTrace& trace_of(const Trial& at_zero_delay, const std::shared_ptr<const server::LoadedScene>& scene) {
    const std::string key = compact_json(experiment_json(at_zero_delay.experiment));
    const auto [place, is_new] = traces_.try_emplace(key);
    if (is_new) place->second = run_virtual_session(at_zero_delay.experiment, scene);
    return place->second;
  }

 private:
  std::map<std::string, SessionTrace> traces_;
};

TrialResult result_of(const Trial& trial, const TrialView& view) {
  TrialResult result;
  result.row = parse_json(pretty_json(trial_row(trial, view)), "a trial's row").get_object();
  result.virtual_s = to_seconds(view.trace.joined_after + trial.experiment.duration);
  result.wall_s = result.virtual_s;
  return result;
}

std::vector<Comparison> compared(const json::object& live, const json::object& beside) {
  std::vector<Comparison> comparisons;
  for (const Compared& each : kCompared) {
    comparisons.push_back({&each, number_in(live, each.metric), number_in(beside, each.metric)});
  }
  return comparisons;
}

std::string scope_of(const LiveResult& result) {
  const json::object& row = result.live.row;
  return text_in(row, "stage") + ", " + format_significant(number_in(row, "rtt_ms"), 3) + " ms, seed " +
         compact_json(row.at("seed"));
}

/// Returns one check for each value that at least one of the two trials (live and virtual) has.
std::vector<Check> checks_of(std::span<const LiveResult> results) {
  std::vector<Check> checks;
  for (const LiveResult& result : results) {
    for (const Comparison& each : result.comparisons) {
      if (each.is_possible()) checks.push_back(each.check(scope_of(result)));
    }
  }
  return checks;
}

Table comparison_table(std::span<const LiveResult> results) {
  Table table{"Compared values",
              {{.header = "Trial", .is_text = true},
               {.header = "Value", .is_text = true},
               {"Real time", ""},
               {"Virtual time", ""},
               {"Allowed difference", ""}},
              {}};
  for (const LiveResult& result : results) {
    for (const Comparison& each : result.comparisons) {
      const bool is_possible = each.is_possible();
      const std::string unit = *each.compared->unit == 0 ? "" : std::string(" ") + each.compared->unit;
      table.rows.push_back(
          {scope_of(result), each.compared->what, format_significant(each.live, 3) + unit,
           format_significant(each.virtual_value, 3) + unit,
           is_possible ? format_significant(each.allowed(), 2) + unit : "not compared: undefined here"});
    }
  }
  return table;
}

/// Returns the first page of the report, without figures: the question, the compared values, and whether they agree.
HtmlReport comparison_page(std::span<const LiveResult> results) {
  HtmlReport page("Real time against virtual time", text_in(results.front().live.row, "experiment"));
  page.question(
      "Do the real server, client and sockets give the same touch in real time as the lab in virtual time? Compared: "
      "the same hands, link and seed. A value agrees if it differs by at most " +
      format_significant(100 * kAllowedShare, 2) + " %, or by the absolute difference of the table.");
  const std::vector<Check> checks = checks_of(results);
  checks.empty() ? page.answer("Nothing could be compared: no value is defined in these trials.")
                 : page.verdict(checks);
  page.table(comparison_table(results));
  return page;
}

HtmlReport single_report(const Experiment& experiment, const LiveResult& result, const SessionTrace& live,
                         const SessionTrace& beside) {
  HtmlReport page = comparison_page(std::span(&result, 1));
  const std::vector<Plot> figures = trial_figures(experiment, live, {&beside, "virtual time"});
  page.figure(figures.front());
  page.appendix();
  page.side_by_side(std::span(figures).subspan(1));
  add_trial_tables(page, live);
  return page;
}

/// Returns a figure of a value as a function of the delay: lines in virtual time, markers in real time.
Plot figure_of(std::span<const LiveResult> results, const Compared& value) {
  Plot figure;
  figure.description = std::string(value.what) + " in real and virtual time over the delay";
  figure.caption =
      std::string(value.metric) + ". Lines: virtual time, means over the seeds; markers: each trial in real time.";
  figure.x = {"round trip", "ms"};
  figure.y = {value.what, *value.unit == 0 ? "1" : value.unit};
  std::map<std::string, std::map<double, std::vector<std::pair<double, double>>>> curves;
  for (const LiveResult& result : results) {
    curves[curve_of(result.live.row)][number_in(result.live.row, "rtt_ms")].emplace_back(
        number_in(result.live.row, value.metric), number_in(result.beside.row, value.metric));
  }
  int style = 0;
  for (const auto& [name, delays] : curves) {
    Series line{name, {}, {}, style, Draw::kLine}, markers{"", {}, {}, style, Draw::kMarkers};
    style = (style + 1) % static_cast<int>(kStyles);
    for (const auto& [rtt_ms, values] : delays) {
      double sum = 0;
      std::size_t count = 0;
      for (const auto& [live, beside] : values) {
        if (std::isfinite(live)) {
          markers.x.push_back(rtt_ms);
          markers.y.push_back(live);
        }
        if (std::isfinite(beside)) sum += beside, ++count;
      }
      if (count == 0) continue;
      line.x.push_back(rtt_ms);
      line.y.push_back(sum / static_cast<double>(count));
    }
    if (line.x.empty() && markers.x.empty()) continue;
    figure.series.push_back(std::move(line));
    figure.series.push_back(std::move(markers));
  }
  return figure;
}

HtmlReport grid_report(std::span<const LiveResult> results, std::span<const TrialResult> live) {
  HtmlReport page = comparison_page(results);
  for (const Compared& value : kCompared) page.figure(figure_of(results, value));
  page.appendix();
  page.heading("Trials in real time");
  add_study(page, live);
  return page;
}

/// Runs a trial and compares it with its virtual counterpart. If `files_in` is given, the time series are written to
/// that folder.
LiveResult run_trial(const Trial& trial, References& references, int realtime_priority,
                     const std::optional<std::filesystem::path>& files_in) {
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  const auto scene = load_experiment_scene(trial.experiment, loading);
  const SessionTrace& reference = references.trace_of(reference_of(trial), scene);
  const SessionTrace& same_stage = references.trace_of(same_stage_of(trial), scene);
  const SessionTrace beside = run_virtual_session(trial.experiment, scene);
  LiveResult result;
  result.beside = result_of(trial, {trial.experiment, beside, &reference, &same_stage});
  std::optional<TrialFiles> files;
  OnTick on_tick;
  if (files_in) {
    files.emplace(trial.experiment, *files_in);
    on_tick = [&](std::size_t user, const client::TickRecord& record, int phase) {
      files->write_tick(user, record, phase);
    };
  }
  const SessionTrace live =
      run_live_session(trial.experiment, scene, beside, realtime_priority, result.timing, on_tick);
  result.live = result_of(trial, {trial.experiment, live, &reference, &same_stage});
  if (files_in) result.live.samples = *files_in;
  result.comparisons = compared(result.live.row, result.beside.row);
  if (files) files->finish(live, "live", single_report(trial.experiment, result, live, beside));
  return result;
}

/// Returns whether all values that can be compared agree. The result is false if no value can be compared.
bool agrees(const LiveResult& result) {
  const auto possible = [](const Comparison& each) { return each.is_possible(); };
  const auto good = [](const Comparison& each) { return !each.is_possible() || each.agrees(); };
  return std::ranges::any_of(result.comparisons, possible) && std::ranges::all_of(result.comparisons, good);
}

json::value verdict_json(const Comparison& comparison) {
  return comparison.is_possible() ? json::value(comparison.agrees()) : json::value();
}

const char* verdict(const Comparison& comparison) {
  if (!comparison.is_possible()) return "  not compared";
  return comparison.agrees() ? "  ok" : "  DISAGREES";
}

double milliseconds(Duration duration) {
  return to_seconds(duration) * 1e3;
}

json::object timing_json(const LiveTiming& timing) {
  json::array users;
  for (const LiveUserTiming& user : timing.users) {
    users.push_back(json::object{{"ticks", user.ticks},
                                 {"milliseconds_without_tick", user.skipped},
                                 {"records_lost", user.lost},
                                 {"lateness_p50_ms", milliseconds(user.loop.lateness.quantile(0.5))},
                                 {"lateness_p99_ms", milliseconds(user.loop.lateness.quantile(0.99))},
                                 {"lateness_max_ms", milliseconds(user.loop.lateness.max())}});
  }
  return {{"users", std::move(users)},
          {"room_step_p99_ms", milliseconds(timing.room.step_time.quantile(0.99))},
          {"room_steps_missed", timing.room.missed},
          {"room_overruns", timing.room.overruns}};
}

json::object comparison_json(const LiveResult& result) {
  json::array compared;
  for (const Comparison& each : result.comparisons) {
    compared.push_back(json::object{{"metric", each.compared->metric},
                                    {"live", each.live},
                                    {"virtual", each.virtual_value},
                                    {"allowed_difference", each.allowed()},
                                    {"agrees", verdict_json(each)}});
  }
  return {{"stage", text_in(result.live.row, "stage")},
          {"rtt_ms", number_in(result.live.row, "rtt_ms")},
          {"seed", result.live.row.at("seed")},
          {"outcome", text_in(result.live.row, "outcome")},
          {"compared", std::move(compared)},
          {"timing", timing_json(result.timing)}};
}

json::object comparisons_json(const std::vector<LiveResult>& results) {
  json::array trials;
  for (const LiveResult& result : results) trials.push_back(comparison_json(result));
  return {{"allowed_share", kAllowedShare}, {"trials", std::move(trials)}};
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(3) << value;
  return text.str();
}

void print_result(const LiveResult& result) {
  std::cout << '\n'
            << text_in(result.live.row, "experiment") << ", " << text_in(result.live.row, "stage") << ", round trip "
            << number_in(result.live.row, "rtt_ms") << " ms, seed " << compact_json(result.live.row.at("seed")) << ": "
            << text_in(result.live.row, "outcome") << '\n'
            << std::left << std::setw(30) << "  compared" << std::right << std::setw(10) << "live" << std::setw(10)
            << "virtual" << std::setw(12) << "difference" << std::setw(9) << "allowed" << '\n';
  for (const Comparison& each : result.comparisons) {
    const std::string unit = *each.compared->unit == 0 ? "" : " [" + std::string(each.compared->unit) + "]";
    std::cout << "  " << std::left << std::setw(28) << each.compared->what + unit << std::right << std::setw(10)
              << number_text(each.live) << std::setw(10) << number_text(each.virtual_value) << std::setw(12)
              << number_text(each.live - each.virtual_value) << std::setw(9)
              << number_text(std::isnan(each.virtual_value) ? each.virtual_value : each.allowed()) << verdict(each)
              << '\n';
  }
  for (const LiveUserTiming& user : result.timing.users) {
    std::cout << "  " << user.ticks << " ticks, " << user.skipped << " ms without one, late p99 "
              << number_text(milliseconds(user.loop.lateness.quantile(0.99))) << " ms, max "
              << number_text(milliseconds(user.loop.lateness.max())) << " ms\n";
  }
}

void write_files(const std::filesystem::path& folder, const std::vector<LiveResult>& results, double wall_s) {
  std::vector<TrialResult> live;
  std::vector<TrialResult> beside;
  for (const LiveResult& result : results) {
    live.push_back(result.live);
    beside.push_back(result.beside);
  }
  std::map<std::string, std::string> files{{"results.json", pretty_json(study_json(live))},
                                           {"results.csv", study_csv(live)},
                                           {"virtual.json", pretty_json(study_json(beside))},
                                           {"comparison.json", pretty_json(comparisons_json(results))}};
  // The report of a single trial shows forces over time and is written together with the time series of the trial.
  if (results.size() > 1) files = with_report(std::move(files), grid_report(results, live));
  files["timing.json"] = pretty_json(json::object{{"wall_s", wall_s}});
  write_all_files(folder.string(), files);
  write_study_hdf5(folder / "results.h5", live);
}

void print_size(const std::vector<Trial>& trials) {
  double seconds = 0;
  for (const Trial& trial : trials) seconds += to_seconds(trial.experiment.duration);
  std::cerr << trials.size() << (trials.size() == 1 ? " trial" : " trials") << " in real time: " << std::ceil(seconds)
            << " s, and some seconds each for the same in virtual time\n";
}

int run_live(const LiveOptions& options) {
  const std::vector<Trial> trials = trials_of_live(options);
  if (trials.empty()) throw std::invalid_argument("there is nothing to run; the grid has no trial");
  print_size(trials);
  const std::filesystem::path folder = made_folder(options.out);
  std::optional<std::filesystem::path> files_in;
  if (trials.size() == 1) files_in = folder;
  References references;
  std::vector<LiveResult> results;
  const SteadyClock wall;
  const LocalTime begin = wall.now();
  for (const Trial& trial : trials) {
    results.push_back(run_trial(trial, references, options.realtime_priority, files_in));
    for (const std::string& line : results.front().timing.realtime_not_granted) {
      if (results.size() == 1) std::cerr << line << '\n';
    }
    if (!options.prints_json) print_result(results.back());
    // Written after each trial, so that earlier results remain if a later trial fails.
    write_files(folder, results, to_seconds(wall.now() - begin));
  }
  if (options.prints_json) std::cout << pretty_json(comparisons_json(results));
  const bool is_good = std::all_of(results.begin(), results.end(), [](const LiveResult& result) {
    return agrees(result) && text_in(result.live.row, "outcome") != "lost";
  });
  return is_good ? 0 : 1;
}

}  // namespace

void add_live_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<LiveOptions>();
  CLI::App* command =
      app.add_subcommand("live", "Runs trials in real time over sockets, and holds them against virtual time");
  command
      ->add_option("experiment", options->experiment,
                   "experiment file (JSON; fields in lab/EXPERIMENTS.md), or name of a shipped one")
      ->required();
  command
      ->add_option("--out", options->out,
                   "folder for results.json, virtual.json, comparison.json, report.html and, of a single trial, the "
                   "time series")
      ->required();
  command->add_option("--set", options->settings,
                      "a quantity with its value, or with several to try, as of run; may be repeated");
  command->add_option("--stage", options->stage, "as --set stage=: one or more of " + listed_stages());
  command->add_option("--seeds", options->seeds, "how many seeds, from the file's on: 1 to 1000")
      ->check(CLI::Range(1, 1000).description(""));
  command->add_flag("--single", options->is_single, "run the file without its grid");
  command
      ->add_option("--rt-priority", options->realtime_priority,
                   "SCHED_FIFO priority of the haptic threads and the room, 1 to 99; 0: normal scheduler")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
  command->add_flag("--json", options->prints_json, "print comparison.json instead of a table");
  command->footer(
      "Exit code: 0 all agree, 1 a trial does not agree, has nothing to compare, or lost a user, 2 bad input or "
      "set-up.");
  command->callback([options, &exit_code] { exit_code = run_live(*options); });
}

}  // namespace tandem::lab

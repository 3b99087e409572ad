// `tandem-lab bench loop`: measures the lateness of the haptic loop of tandem-client, with and without a window. The
// lateness is compared with the wake-up latency of this machine.
//
//   this process     runs a server with its threads, as in tandem-server, during the whole measurement
//   child processes  one at a time: cyclictest, tandem-client --headless, tandem-client with its window; repeated

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/report/check.hpp"
#include "lab/results/study_results.hpp"
#include "server/assets/scene_file.hpp"
#include "server/net/live_server.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

// Upper limits for the effect of the window on the haptic loop. The values are our choice. Their order is:
// * ratio of a percentile with window to the percentile without window
// * 99th percentile of the lateness [µs] that is accepted regardless of the ratios
// * ratio of a percentile of the client to that of cyclictest
// * additional late ticks [%]
constexpr double kWindowShare = 1.5, kWindowAllowed_us = 150, kPeerShare = 1.3, kLateAllowed_percent = 0.1;
constexpr int kServerPriority = 60;

struct LoopBenchOptions {
  double seconds = 20;
  int pairs = 1;
  int realtime_priority = 80;
  std::string scene = "two_boxes";
  std::string keep_awake = "auto";
  bool has_window = false;
  bool is_checked = false;
  bool prints_json = false;
};

/// Results of one run, or medians of several runs.
struct LoopFigures {
  double p50_us = 0, p99_us = 0, p999_us = 0, max_us = 0;
  double missed = 0;
  double late_percent = 0;  ///< percentage of ticks that are more than 1 ms late
  double tick_p50_us = 0, tick_p99_us = 0;
  /// 1 if deep idle states of the processor were disabled, otherwise 0; median if there are several runs
  double awake = 0;
};

struct LoopBenchResult {
  std::vector<LoopFigures> headless, window, peer;
};

class ServerBeside {
 public:
  explicit ServerBeside(const std::string& scene_name) {
    server::SceneLoading loading;
    loading.progress = progress_on_stderr();
    const auto scene = server::load_scene(scene_path(scene_name, ""), loading);
    std::vector<std::unique_ptr<server::Room>> rooms;
    rooms.push_back(std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene));
    server::LiveServerSettings settings;
    settings.port = 0;
    settings.realtime_priority = kServerPriority;
    server_ = std::make_unique<server::LiveServer>(settings, std::move(rooms));
    thread_ = std::thread([this] { server_->run(); });
  }
  ~ServerBeside() {
    server_->stop();
    thread_.join();
  }
  ServerBeside(const ServerBeside&) = delete;
  ServerBeside& operator=(const ServerBeside&) = delete;
  std::uint16_t port() const { return server_->port(); }

 private:
  std::unique_ptr<server::LiveServer> server_;
  std::thread thread_;
};

/// Runs a command and returns its standard output.
/// Fails   std::runtime_error: the command cannot be started, or its exit code is not 0
std::string output_of(const std::string& command) {
  std::FILE* const pipe = popen(command.c_str(), "re");
  if (pipe == nullptr) throw std::runtime_error("'" + command + "' cannot be started");
  std::string text;
  std::array<char, 4096> bytes{};
  while (const std::size_t count = std::fread(bytes.data(), 1, bytes.size(), pipe)) text.append(bytes.data(), count);
  if (pclose(pipe) != 0) throw std::runtime_error("'" + command + "' failed; see its output above");
  return text;
}

std::string client_program() {
  const std::filesystem::path beside = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "tandem-client";
  if (!std::filesystem::exists(beside)) throw std::runtime_error("there is no " + beside.string() + "; build it");
  return "'" + beside.string() + "'";
}

LoopFigures figures_of_client(const std::string& text) {
  const json::object report = boost::json::parse(text).as_object();
  const json::object& late = report.at("lateness_us").as_object();
  const json::object& tick = report.at("tick_us").as_object();
  return {number_in(late, "p50"),
          number_in(late, "p99"),
          number_in(late, "p999"),
          number_in(late, "max"),
          report.at("missed").to_number<double>(),
          100 * number_in(report, "late_by_1_ms_share"),
          number_in(tick, "p50"),
          number_in(tick, "p99"),
          report.at("keeps_awake").as_bool() ? 1.0 : 0.0};
}

LoopFigures run_client(const LoopBenchOptions& options, std::uint16_t port, bool has_window) {
  std::ostringstream command;
  command << client_program() << " --insecure --server 127.0.0.1:" << port
          << " --device sim --hand circle --json --duration " << options.seconds << "s --rt-priority "
          << options.realtime_priority << " --keep-awake " << options.keep_awake << (has_window ? "" : " --headless");
  return figures_of_client(output_of(command.str()));
}

/// Parses the output of cyclictest. A line such as "000012 000345" contains a lateness [µs] and the number of wake-ups
/// with that lateness.
LoopFigures figures_of_cyclictest(const std::string& text) {
  Histogram lateness;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::uint64_t late_us = 0, count = 0;
    if (std::sscanf(line.c_str(), "%lu %lu", &late_us, &count) != 2) continue;
    for (; count > 0; --count) lateness.record(std::chrono::microseconds(late_us));
  }
  LoopFigures figures;
  figures.p50_us = microseconds(lateness.quantile(0.5));
  figures.p99_us = microseconds(lateness.quantile(0.99));
  figures.p999_us = microseconds(lateness.quantile(0.999));
  figures.max_us = microseconds(lateness.max());
  figures.late_percent = 100 * lateness.share_above(std::chrono::milliseconds(1));
  return figures;
}

bool has_cyclictest() {
  return std::system("command -v cyclictest >/dev/null") == 0;
}

LoopFigures run_cyclictest(const LoopBenchOptions& options) {
  std::ostringstream command;
  command << "cyclictest -m -p " << options.realtime_priority << " -i 1000 -q -h 4000 -D "
          << std::ceil(options.seconds);
  return figures_of_cyclictest(output_of(command.str()));
}

LoopBenchResult measure_loop_bench(const LoopBenchOptions& options) {
  const ServerBeside server(options.scene);
  const bool has_peer = has_cyclictest();
  if (!has_peer) std::cerr << "cyclictest is not installed (package rt-tests): no comparison\n";
  LoopBenchResult result;
  for (int i = 0; i < options.pairs; ++i) {
    if (has_peer) result.peer.push_back(run_cyclictest(options));
    result.headless.push_back(run_client(options, server.port(), false));
    if (options.has_window) result.window.push_back(run_client(options, server.port(), true));
  }
  return result;
}

double median(const std::vector<LoopFigures>& runs, double LoopFigures::*figure) {
  if (runs.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> values;
  for (const LoopFigures& run : runs) values.push_back(run.*figure);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

LoopFigures medians(const std::vector<LoopFigures>& runs) {
  LoopFigures result;
  for (const auto figure :
       {&LoopFigures::p50_us, &LoopFigures::p99_us, &LoopFigures::p999_us, &LoopFigures::max_us, &LoopFigures::missed,
        &LoopFigures::late_percent, &LoopFigures::tick_p50_us, &LoopFigures::tick_p99_us, &LoopFigures::awake}) {
    result.*figure = median(runs, figure);
  }
  return result;
}

std::vector<Check> checks_of(const LoopBenchResult& result) {
  std::vector<Check> checks;
  const LoopFigures headless = medians(result.headless);
  if (!result.peer.empty()) {
    checks.push_back({"headless", "p99 of lateness, 1.3 times that of cyclictest at most", headless.p99_us,
                      Relation::kAtMost, kPeerShare * medians(result.peer).p99_us, "µs", 1});
  }
  if (result.window.empty()) return checks;
  const LoopFigures window = medians(result.window);
  checks.push_back({"with window", "p99 of lateness", window.p99_us, Relation::kAtMost,
                    std::max(kWindowShare * headless.p99_us, kWindowAllowed_us), "µs", 1});
  checks.push_back({"with window", "p99.9 of lateness", window.p999_us, Relation::kAtMost,
                    kWindowShare * headless.p999_us, "µs", 1});
  checks.push_back({"with window", "ticks more than 1 ms late", window.late_percent, Relation::kAtMost,
                    headless.late_percent + kLateAllowed_percent, "%", 3});
  return checks;
}

json::object to_json(const LoopFigures& figures) {
  return {{"lateness_us",
           {{"p50", figures.p50_us}, {"p99", figures.p99_us}, {"p999", figures.p999_us}, {"max", figures.max_us}}},
          {"missed", figures.missed},
          {"late_by_1_ms_percent", figures.late_percent},
          {"tick_us", {{"p50", figures.tick_p50_us}, {"p99", figures.tick_p99_us}}},
          {"keeps_awake", figures.awake > 0}};
}

json::value to_json(const std::vector<LoopFigures>& runs) {
  if (runs.empty()) return nullptr;
  json::object result = to_json(medians(runs));
  json::array each;
  for (const LoopFigures& run : runs) each.push_back(to_json(run));
  result["runs"] = std::move(each);
  return result;
}

json::object to_json(const LoopBenchOptions& options, const LoopBenchResult& result, const std::vector<Check>& checks) {
  json::object report = to_json(medians(result.headless));
  report["seconds"] = options.seconds;
  report["pairs"] = options.pairs;
  report["rt_priority"] = options.realtime_priority;
  report["headless"] = to_json(result.headless);
  report["with_window"] = to_json(result.window);
  report["cyclictest"] = to_json(result.peer);
  report["checks"] = to_json(checks);
  return report;
}

void print_runs(const char* name, const std::vector<LoopFigures>& runs) {
  if (runs.empty()) return;
  const LoopFigures f = medians(runs);
  std::printf("%-12s %8.1f %8.1f %8.1f %8.1f %8.0f %8.3f %8.1f %8.1f\n", name, f.p50_us, f.p99_us, f.p999_us, f.max_us,
              f.missed, f.late_percent, f.tick_p50_us, f.tick_p99_us);
}

void print(const LoopBenchOptions& options, const LoopBenchResult& result, const std::vector<Check>& checks) {
  const bool is_awake = medians(result.headless).awake > 0;
  std::printf("medians of %d x %g s, SCHED_FIFO %d%s\n%-12s %8s %8s %8s %8s %8s %8s %8s %8s\n", options.pairs,
              options.seconds, options.realtime_priority, is_awake ? ", the client's processor kept awake" : "",
              "late [us]", "p50", "p99", "p99.9", "max", "missed", "> 1ms %", "tick p50", "tick p99");
  print_runs("cyclictest", result.peer);
  print_runs("headless", result.headless);
  print_runs("with window", result.window);
  std::fflush(stdout);
  print_checks(std::cout, checks);
}

void check_display() {
  const auto is_set = [](const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  if (is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")) return;
  throw std::invalid_argument(
      "--with-window: there is no display (DISPLAY and WAYLAND_DISPLAY are not set); start it on a desktop, or as "
      "xvfb-run tandem-lab bench loop --with-window");
}

int run_loop_bench(const LoopBenchOptions& options) {
  if (options.has_window) check_display();
  const LoopBenchResult result = measure_loop_bench(options);
  const std::vector<Check> checks = checks_of(result);
  if (options.prints_json) {
    std::cout << pretty_json(to_json(options, result, checks));
  } else {
    print(options, result, checks);
  }
  return all_hold(checks) || !options.is_checked ? 0 : 1;
}

}  // namespace

void add_loop_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<LoopBenchOptions>();
  CLI::App* command = bench.add_subcommand(
      "loop", "How late the haptic loop of tandem-client wakes, and how long its ticks take, beside cyclictest");
  command->add_option("--seconds", options->seconds, "how long each run takes [s]")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command->add_option("--pairs", options->pairs, "how often, all in turn; medians are printed")
      ->check(CLI::Range(1, 99))
      ->capture_default_str();
  command->add_option("--scene", options->scene, "name of a shipped scene, or path of a scene file")
      ->capture_default_str();
  command
      ->add_option("--rt-priority", options->realtime_priority,
                   "SCHED_FIFO priority of the loop and of cyclictest, 1 to 99; 0: normal scheduler")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
  command->add_option("--keep-awake", options->keep_awake, "of tandem-client, see there; on: to measure its effect")
      ->check(CLI::IsMember({"auto", "on", "off"}).description(""))
      ->type_name("auto|on|off")
      ->capture_default_str();
  command->add_flag("--with-window", options->has_window, "each time with the window open, too; needs a display");
  command->add_flag("--check", options->is_checked, "exit 1 when a bound does not hold");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->callback([options, &exit_code] { exit_code = run_loop_bench(*options); });
}

}  // namespace tandem::lab

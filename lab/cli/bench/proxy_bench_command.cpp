// `tandem-lab bench proxy`: measures the duration of point contact with a mesh. It is compared with a loop that only
// finds the closest point, in the same run.

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>

#include "common/base/json_pretty.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/report/check.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/contact/mesh_source.hpp"
#include "lab/studies/contact/proxy_bench.hpp"

namespace tandem::lab {
namespace {

/// Time budget of point contact in a tick of 1 ms: median and 99th percentile. Other computations need the rest of the
/// tick.
constexpr double kMedianBudget_us = 4;
constexpr double kP99Budget_us = 20;
/// Number of timed rounds of each loop. The loops alternate, and the times of all rounds are pooled. An untimed round
/// before them fills the caches.
constexpr int kProxyRounds = 3;

struct ProxyBenchOptions {
  std::string mesh;
  double size_mm = 100;
  double radius_mm = 1;
  std::size_t steps = 20'000;
  bool is_shaded = true;
  bool is_checked = false;
  bool prints_json = false;
};

struct Result {
  std::size_t triangles = 0;
  double hand_depth_m = 0;
  ProxyFigures ours;
  ProxyLag lag;
  ProxyFigures closest_point;
};

Result measure_proxy_bench(const ProxyBenchOptions& options) {
  const SteadyClock clock;
  const geometry::TriangleMesh mesh = mesh_from(options.mesh, "--mesh", options.size_mm / 1e3);
  const haptics::GodObjectSettings settings{options.radius_mm / 1e3, options.is_shaded};
  const auto shared = std::make_shared<const haptics::ProxyMesh>(mesh);
  const std::vector<Vec3> hand = wandering_hand(mesh, options.steps);
  const geometry::TriangleTree tree(mesh);
  std::vector<ProxyRun> ours, closest_point;
  for (int round = 0; round < 1 + kProxyRounds; ++round) {
    ours.push_back(run_god_object(shared, settings, hand, clock));
    closest_point.push_back(run_closest_point(tree, settings.radius_m, hand, clock));
  }
  ours.erase(ours.begin());
  closest_point.erase(closest_point.begin());
  Result result;
  result.triangles = mesh.triangles.size();
  result.hand_depth_m = depth_of(hand, tree);
  result.ours = figures_of(ours, mesh, settings.radius_m);
  result.lag = lag_of(shared, settings, hand);
  result.closest_point = figures_of(closest_point, mesh, settings.radius_m);
  return result;
}

std::vector<Check> checks_of(const Result& result) {
  return {{"proxy", "median of an update", result.ours.loop_us.p50_us, Relation::kAtMost, kMedianBudget_us, "µs", 2},
          {"proxy", "p99 of an update", result.ours.loop_us.p99_us, Relation::kAtMost, kP99Budget_us, "µs", 2},
          {"proxy", "deepest inside the mesh", 1e9 * result.ours.max_penetration_m, Relation::kAtMost,
           1e9 * haptics::GodObject::kTolerance_m, "nm", 2},
          {"proxy", "pop-throughs", static_cast<double>(result.ours.pop_throughs), Relation::kAtMost, 0, "", 0}};
}

boost::json::object to_json(const ProxyBenchOptions& options, const Result& result, const std::vector<Check>& checks) {
  boost::json::object json{
      {"mesh", options.mesh},   {"triangles", result.triangles}, {"radius_m", options.radius_mm / 1e3},
      {"steps", options.steps}, {"rounds", kProxyRounds},        {"hand_depth_m", result.hand_depth_m}};
  for (const auto& [key, value] : to_json(result.ours)) json[key] = value;
  for (const auto& [key, value] : to_json(result.lag)) json[key] = value;
  boost::json::object closest_point = to_json(result.closest_point);
  closest_point["triangles"] = result.triangles;
  json["closest_point"] = std::move(closest_point);
  json["checks"] = to_json(checks);
  return json;
}

std::string to_text(const std::string& name, const ProxyFigures& figures) {
  const TimeQuantiles& times = figures.loop_us;
  return name + format_significant(times.p50_us, 3) + " / " + format_significant(times.p99_us, 3) + " / " +
         format_significant(times.max_us, 3) + " µs, " + format_significant(1e3 * figures.max_penetration_m, 3) +
         " mm inside, " + std::to_string(figures.pop_throughs) + " pop-throughs\n";
}

std::string to_text(const ProxyLag& lag) {
  return "proxy not yet at rest in " + format_significant(100 * lag.held_back_share, 2) +
         " % of the ticks; lag behind where it would rest p50 / p99 / max " + format_significant(1e3 * lag.p50_m, 3) +
         " / " + format_significant(1e3 * lag.p99_m, 3) + " / " + format_significant(1e3 * lag.max_m, 3) + " mm\n";
}

int run_proxy_bench(const ProxyBenchOptions& options) {
  const Result result = measure_proxy_bench(options);
  const std::vector<Check> checks = checks_of(result);
  if (options.prints_json) {
    std::cout << pretty_json(to_json(options, result, checks));
  } else {
    std::cout << options.mesh << ", " << result.triangles << " triangles, " << options.steps
              << " ticks of 1 ms, the hand up to " << format_significant(1e3 * result.hand_depth_m, 3)
              << " mm deep\ntimes p50 / p99 / max over " << kProxyRounds << " runs\n"
              << to_text("proxy          ", result.ours) << to_text("closest point  ", result.closest_point)
              << to_text(result.lag);
    if (options.is_checked) print_checks(std::cout, checks);
  }
  return options.is_checked && !all_hold(checks) ? 1 : 0;
}

}  // namespace

void add_proxy_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<ProxyBenchOptions>();
  CLI::App* command = bench.add_subcommand("proxy", "A point pressed into a mesh and drawn over it");
  command->add_option("--mesh", options->mesh, "a mesh file, or peg, box_with_hole, sphere, cube")->required();
  command->add_option("--size-mm", options->size_mm, "longest edge of the bounding box of a mesh from a file [mm]")
      ->check(CLI::Range(1.0, 10'000.0))
      ->capture_default_str();
  command->add_option("--radius-mm", options->radius_mm, "of the proxy [mm]")
      ->check(CLI::Range(0.05, 100.0))
      ->capture_default_str();
  command->add_option("--steps", options->steps, "of 1 ms")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  command->add_flag("!--no-shading", options->is_shaded, "leave force shading out");
  command->add_flag("--check", options->is_checked, "exit code 1 when a bound does not hold");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->footer("Exit code: 0 done, 1 a bound of --check does not hold, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_proxy_bench(*options); });
}

}  // namespace tandem::lab

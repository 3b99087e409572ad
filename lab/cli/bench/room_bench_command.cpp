// `tandem-lab bench room`: runs the room of a scene in real time, with simulated hands that touch the scene.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "common/base/tick_faults.hpp"
#include "common/base/time.hpp"
#include "common/realtime/realtime.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/report/check.hpp"
#include "lab/session/simulated_user.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::lab {
namespace {

struct RoomBenchResult {
  Histogram step;              ///< duration of a step of the room: inputs, physics, updates
  std::uint64_t overlong = 0;  ///< number of steps that took longer than the period
  Histogram lateness;          ///< lateness of the wake-ups; the machine causes it, not the room
  std::uint64_t missed = 0;    ///< number of periods skipped because a wake-up was more than one period late
  TickFaults faults = 0;
  std::uint32_t contacts_max = 0;  ///< maximum number of active contacts, summed over all tools
  double depth_max_m = 0;
  double force_max_n = 0;  ///< largest contact force of one tool
};

void record_touch(const server::Room& room, std::size_t users, RoomBenchResult& result) {
  std::uint32_t contacts = 0;
  for (std::size_t i = 0; i < users; ++i) {
    const physics::TouchSummary touch = room.world().touch(i);
    contacts += touch.contacts;
    result.depth_max_m = std::max(result.depth_max_m, touch.deepest_m);
    result.force_max_n = std::max({result.force_max_n, touch.force_n, touch.soft_force_n});
  }
  result.contacts_max = std::max(result.contacts_max, contacts);
}

/// Runs the room in real time on the calling thread. The hands move between the steps and receive the wrench of each
/// step without delay.
///
/// In      hands  names of hand paths, one for each user; the n-th user gets the n-th tool
/// Fails   std::invalid_argument: there are more hands than tools, or a path is unknown
RoomBenchResult bench_room(const std::shared_ptr<const server::LoadedScene>& scene,
                           const std::vector<std::string>& hands, Duration duration) {
  constexpr std::uint64_t kSeed = 1;
  if (hands.size() > scene->world.tools.size()) {
    throw std::invalid_argument("--users " + std::to_string(hands.size()) + ": the scene has " +
                                std::to_string(scene->world.tools.size()) + " tools; give fewer users");
  }
  // Passivity control is off. It would limit a tool to the energy that its hand supplies, and the simulated users
  // report no supplied energy.
  const server::RoomOptions options{.steps_soft_aside = true, .controls_tool_passivity = false};
  const auto room = std::make_unique<server::Room>(RoomId{1}, scene->description.name(), scene, options);
  std::vector<std::unique_ptr<SimulatedUser>> seats;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    seats.push_back(std::make_unique<SimulatedUser>(*room, i, devices::named_hand_path(hands[i]), kSeed + i));
  }
  RoomBenchResult result;
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  realtime::PeriodicTimer timer(room->period(), begin);
  for (LocalTime due = timer.wait(); due < begin + duration; due = timer.wait()) {
    for (const auto& seat : seats) seat->move(due);
    const LocalTime before = clock.now();
    room->step(server_time_of_own_clock(before));
    const Duration took = clock.now() - before;
    result.step.record(took);
    if (took > room->period()) ++result.overlong;
    for (const auto& seat : seats) seat->feel(due);
    record_touch(*room, seats.size(), result);
    for (std::size_t i = 0; i < seats.size(); ++i) result.faults |= room->output().front().own[i].tick_faults;
  }
  result.lateness = timer.lateness();
  result.missed = timer.missed();
  return result;
}

/// Time budget of a step at 1 kHz. Client, network and operating system need the rest of the period.
constexpr double kStepBudget_us = 250;
constexpr double kOverlongShare_percent = 0.1;
constexpr std::size_t kDefaultUsers = 2;

struct RoomBenchOptions {
  std::string scene = "bunny";
  std::size_t users = 0;  ///< 0: as many users as the scene has tools, but at most kDefaultUsers
  std::vector<std::string> hands;
  double seconds = 11;
  bool prints_json = false;
};

std::vector<Check> checks_of(const RoomBenchResult& result) {
  const double overlong = 100.0 * static_cast<double>(result.overlong) / static_cast<double>(result.step.count());
  return {
      {"room", "p99 of a step", microseconds(result.step.quantile(0.99)), Relation::kAtMost, kStepBudget_us, "µs", 0},
      {"room", "steps longer than the period", overlong, Relation::kAtMost, kOverlongShare_percent, "%", 2}};
}

boost::json::object to_json(const RoomBenchOptions& options, const RoomBenchResult& result,
                            const std::vector<Check>& checks) {
  boost::json::array faults;
  for (const std::string& name : tick_fault_names(result.faults)) faults.emplace_back(name);
  return {{"scene", options.scene},
          {"users", options.users},
          {"steps", result.step.count()},
          {"step_us", quantiles_us(result.step)},
          {"steps_longer_than_period", result.overlong},
          {"wake_up_lateness_us", quantiles_us(result.lateness)},
          {"periods_missed_by_late_wake_ups", result.missed},
          {"contacts_max", result.contacts_max},
          {"depth_max_m", result.depth_max_m},
          {"force_max_n", result.force_max_n},
          {"tick_faults", faults},
          {"checks", to_json(checks)}};
}

void print(const RoomBenchOptions& options, const RoomBenchResult& result, const std::vector<Check>& checks) {
  const auto line = [](const char* what, const Histogram& h) {
    std::cout << what << "  p50 " << microseconds(h.quantile(0.5)) << ", p99 " << microseconds(h.quantile(0.99))
              << ", p99.9 " << microseconds(h.quantile(0.999)) << ", max " << microseconds(h.max()) << " µs\n";
  };
  std::cout << options.scene << ", " << options.users << " users, " << result.step.count() << " steps\n";
  line("step              ", result.step);
  line("wake-up lateness  ", result.lateness);
  std::cout << "contacts up to " << result.contacts_max << ", depth up to " << result.depth_max_m * 1e3
            << " mm, force up to " << result.force_max_n << " N, tick faults " << describe_faults(result.faults)
            << "\n";
  print_checks(std::cout, checks);
}

/// Returns one path for each user. A user for whom no path is named gets a path that presses down: in the shipped
/// scenes, every tool has an object below it.
std::vector<std::string> hands_of(const RoomBenchOptions& options) {
  std::vector<std::string> hands = options.hands;
  if (hands.size() > options.users) {
    throw std::invalid_argument("--hands names " + std::to_string(hands.size()) + " paths for " +
                                std::to_string(options.users) + (options.users == 1 ? " user" : " users") +
                                "; name fewer, or give --users");
  }
  hands.resize(options.users, "press-down");
  return hands;
}

int run_room_bench(RoomBenchOptions options) {
  // Checks the command line before the scene is loaded, because loading takes time.
  if (options.users != 0) hands_of(options);
  server::SceneLoading loading;
  loading.progress = progress_on_stderr();
  const auto scene = server::load_scene(scene_path(options.scene, ""), loading);
  if (options.users == 0) options.users = std::min(kDefaultUsers, scene->world.tools.size());
  const std::vector<std::string> hands = hands_of(options);
  for (const std::string& refusal : realtime::request_realtime(60)) std::cerr << refusal << '\n';
  const RoomBenchResult result = bench_room(scene, hands, from_seconds(options.seconds));
  const std::vector<Check> checks = checks_of(result);
  if (options.prints_json) {
    std::cout << pretty_json(to_json(options, result, checks));
  } else {
    print(options, result, checks);
  }
  return all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_room_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<RoomBenchOptions>();
  CLI::App* command = bench.add_subcommand("room", "Steps of a scene's room in real time, with hands that touch it");
  command->add_option("--scene", options->scene, "name of a shipped scene, or path of a scene file")
      ->capture_default_str();
  command
      ->add_option("--users", options->users,
                   "users; the n-th gets the n-th tool [default: 2, or 1 when the scene has one tool]")
      ->check(CLI::Range(1, 16));
  command->add_option("--hands", options->hands, "named hand path of each user [default: press-down for all]")
      ->type_name("NAME");
  command->add_option("--seconds", options->seconds, "how long [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->callback([options, &exit_code] { exit_code = run_room_bench(*options); });
}

}  // namespace tandem::lab

// `tandem-lab bench goals`: measures the cost of a game. Two rooms run the same scene, one with its game and one
// without.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/processor_time.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/report/check.hpp"
#include "lab/session/simulated_user.hpp"
#include "server/assets/scene_file.hpp"

namespace tandem::lab {
namespace {

/// Upper limit for the additional time of a step with a game: difference of the two medians.
constexpr double kMaxAdditional_us = 3;

struct GoalsBenchOptions {
  std::string scene = "ring";
  std::string hand = "grab-and-lift";
  double seconds = 10;
  bool is_checked = false;
  bool prints_json = false;
};

/// A room with a simulated hand that holds the room's first tool.
struct BenchRoom {
  BenchRoom(std::shared_ptr<const server::LoadedScene> scene, const std::string& hand)
      : room(RoomId{1}, scene->description.name(), scene, {.controls_tool_passivity = false}),
        user(room, 0, devices::named_hand_path(hand), 1) {}

  /// Steps the room. Records the processor time of the step.
  void step(LocalTime due) {
    user.move(due);
    const Duration before = processor_time();
    room.step(server_time_of_own_clock(due));
    took.record(processor_time() - before);
    user.feel(due);
  }

  server::Room room;
  SimulatedUser user;
  Histogram took;
};

int run_goals_bench(const GoalsBenchOptions& options) {
  const auto scene = server::load_scene(scene_path(options.scene, ""));
  if (!scene->description.has_game()) {
    throw std::invalid_argument("--scene " + options.scene + ": the scene has no game; name one that has");
  }
  const auto plain = std::make_shared<server::LoadedScene>(*scene);
  plain->description.clear_game();
  const auto with = std::make_unique<BenchRoom>(scene, options.hand);
  const auto without = std::make_unique<BenchRoom>(plain, options.hand);
  // The two rooms step alternately and swap their order each time, so that changes of the machine's speed affect both.
  const auto steps = static_cast<std::uint64_t>(options.seconds / to_seconds(with->room.period()));
  LocalTime due{};
  for (std::uint64_t i = 0; i < steps; ++i) {
    due += with->room.period();
    for (BenchRoom* const room :
         i % 2 == 0 ? std::array{with.get(), without.get()} : std::array{without.get(), with.get()}) {
      room->step(due);
    }
  }
  const double more_us = microseconds(with->took.quantile(0.5)) - microseconds(without->took.quantile(0.5));
  const std::vector<Check> checks{
      {"goals", "additional time of a step, medians", more_us, Relation::kAtMost, kMaxAdditional_us, "µs", 2}};
  if (options.prints_json) {
    std::cout << pretty_json(boost::json::object{{"scene", options.scene},
                                                 {"steps", steps},
                                                 {"with_game_us", lab::quantiles_us(with->took)},
                                                 {"without_game_us", lab::quantiles_us(without->took)},
                                                 {"additional_us", more_us},
                                                 {"checks", to_json(checks)}});
  } else {
    for (const auto& [name, room] :
         {std::pair("with its game   ", with.get()), std::pair("without its game", without.get())}) {
      std::cout << name << "  p50 " << microseconds(room->took.quantile(0.5)) << ", p99 "
                << microseconds(room->took.quantile(0.99)) << " µs of processor time a step\n";
    }
    print_checks(std::cout, checks);
  }
  return !options.is_checked || all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_goals_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<GoalsBenchOptions>();
  CLI::App* command = bench.add_subcommand("goals", "Steps of a room with the game of its scene, and without it");
  command->add_option("--scene", options->scene, "name of a shipped scene with a game, or path of a scene file")
      ->capture_default_str();
  command->add_option("--hand", options->hand, "named hand path of the user")->type_name("NAME")->capture_default_str();
  command->add_option("--seconds", options->seconds, "how long, in time of the room [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--check", options->is_checked, "return 1 if a bound does not hold");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->callback([options, &exit_code] { exit_code = run_goals_bench(*options); });
}

}  // namespace tandem::lab

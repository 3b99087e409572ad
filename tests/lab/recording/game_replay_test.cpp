// Tests that the replay of a recorded game gives the same score and events in each step.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "lab/recording/session_replay.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "server/recording/room_recorder.hpp"
#include "tests/server/goals/game_room.hpp"

namespace tandem::lab {
namespace {

/// Records the score and the number of events after each step.
class Progress final : public server::RoomWatcher {
 public:
  void on_command(const server::RoomCommand& /*command*/) noexcept override {}
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const server::Room& room, ServerTime /*now*/, TickFaults /*faults*/) noexcept override { add(room); }
  void add(const server::Room& room) {
    const server::GameStatus& status = room.game()->status();
    events_ += room.game()->events().size();
    steps.emplace_back(status.total(), status.steps, status.level, events_, hash_of(status));
  }

  std::vector<std::tuple<double, std::uint64_t, int, std::size_t, std::uint32_t>> steps;

 private:
  std::size_t events_ = 0;
};

TEST(GameReplay, GivesTheSameScoreAndEventsInEachStep) {
  const auto file = std::filesystem::temp_directory_path() / ("tandem_game" + std::to_string(::getpid()) + ".mcap");
  const auto scene_file = physics::shipped_scene("ring");
  Progress then;
  {
    server::GameRoom game(server::load_scene(scene_file));
    server::RoomRecorder recorder(
        game.room,
        {.file = file, .program = "test 1", .scene_file = scene_file.string(), .recording = 7, .capacity = 1U << 17U});
    game.room.watch(recorder);
    game.room.watch(then);
    game.join(0);
    server::play_ring(game);
    game.command({.kind = server::RoomCommand::Kind::kSetWeight, .is_weightless = true});
    game.run(0.3);
    game.command({.kind = server::RoomCommand::Kind::kStartLevel, .level = 0});
    game.run(0.3);
    recorder.finish();
    EXPECT_EQ(recorder.steps_lost(), 0U);
  }
  Progress now;
  const ReplayResult result = replay_session(file, {}, [&now](const server::Room& room) { now.add(room); });
  EXPECT_FALSE(result.differs_at_step.has_value()) << result.differing_thing;
  EXPECT_EQ(now.steps, then.steps);
  ASSERT_FALSE(now.steps.empty());
  EXPECT_GE(std::get<3>(now.steps.back()), 6U) << "the game was won, and a level was started";

  std::vector<wire::GameEvent> events;
  wire::RecordedStates states;
  proto::read_recording(file, [&](const std::string& topic, const recording::Message& message) {
    wire::RecordedStep step;
    if (topic == "/step" && proto::parse_recorded(message, step)) {
      events.insert(events.end(), step.game_events().begin(), step.game_events().end());
    }
    if (topic == "/states") proto::parse_recorded(message, states);
    return true;
  });
  EXPECT_EQ(events.size(), std::get<3>(now.steps.back()));
  EXPECT_TRUE(states.game().is_weightless());
  std::filesystem::remove(file);
}

TEST(GameReplay, SignalsDecideTheSameLevelsInEachStep) {
  const auto file = std::filesystem::temp_directory_path() / ("tandem_signals" + std::to_string(::getpid()) + ".mcap");
  const auto scene_file = file.string() + ".json";
  std::ofstream(scene_file) << server::small_game(R"({"signals": [{"name": "valence", "max_age_s": 0.3, "states": [
      {"name": "negative", "below": 0}, {"name": "positive", "above": 0}]}], "levels": [
    {"name": "a", "time_limit_s": 1, "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}},
        {"signal": {"name": "valence", "above": 0.2, "required": true}}]}],
     "next": {"signal": "valence", "rows": [{"state": "positive", "level": "b"}, {"level": "a"}]}},
    {"name": "b", "time_limit_s": 1, "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}}]}],
     "next": {"signal": "valence", "rows": [{"state": "negative", "level": "a"}, {"level": "b"}]}}]})");
  Progress then;
  {
    server::GameRoom game(server::load_scene(scene_file));
    server::RoomRecorder recorder(
        game.room,
        {.file = file, .program = "test 1", .scene_file = scene_file, .recording = 7, .capacity = 1U << 17U});
    game.room.watch(recorder);
    game.room.watch(then);
    game.join(0);
    for (int i = 0; i < 40; ++i) {
      const double value = i < 20 ? 0.5 : -0.5;
      const auto age_steps = static_cast<std::uint32_t>(7 * i);
      if (i % 3 != 0) {
        ASSERT_TRUE(
            game.room.post({.kind = server::RoomCommand::Kind::kSetSignal, .signal_value = {value, 0.9, age_steps}}));
      }
      game.run(0.1);
    }
    recorder.finish();
    EXPECT_EQ(recorder.steps_lost(), 0U);
  }
  Progress now;
  const ReplayResult result = replay_session(file, {}, [&now](const server::Room& room) { now.add(room); });
  EXPECT_FALSE(result.differs_at_step.has_value()) << result.differing_thing;
  EXPECT_EQ(now.steps, then.steps);
  std::set<int> levels;
  for (const auto& step : now.steps) levels.insert(std::get<2>(step));
  EXPECT_EQ(levels, (std::set<int>{0, 1})) << "the signal must have changed the level";
  std::size_t values = 0;
  proto::read_recording(file, [&](const std::string& topic, const recording::Message& message) {
    wire::RecordedStep step;
    if (topic != "/step" || !proto::parse_recorded(message, step)) return true;
    for (const auto& command : step.commands()) values += command.kind() == wire::RecordedCommand::SET_SIGNAL ? 1U : 0U;
    return true;
  });
  EXPECT_EQ(values, 26U) << "each value is in the recording";
  std::filesystem::remove(file);
  std::filesystem::remove(scene_file);
}

TEST(GameReplay, OfSignalsAndADecisionTableGivesTheSameLevels) {
  const auto folder = std::filesystem::temp_directory_path() / ("tandem_signals" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const auto scene_file = folder / "signals.json", file = folder / "signals.mcap";
  std::ofstream(scene_file) << server::small_game(R"({"time_limit_s": 4.5, "call": {"at_time_limit": true},
      "signals": [{"name": "valence", "max_age_s": 0.5, "states": [
        {"name": "negative", "below": -0.1}, {"name": "positive", "above": 0.1}]}],
      "levels": [
        {"name": "a", "time_limit_s": 1, "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}}]}],
         "next": {"signal": "valence", "rows": [{"state": "positive", "level": "b"}, {"level": "a"}]}},
        {"name": "b", "time_limit_s": 1, "goals": [{"name": "g", "conditions": [{"held": {"body": "ball"}}]}],
         "next": {"signal": "valence", "rows": [{"state": "negative", "level": "a"}, {"level": "b"}]}}]})");
  Progress then;
  {
    server::GameRoom game(server::load_scene(scene_file));
    server::RoomRecorder recorder(
        game.room,
        {.file = file, .program = "test 1", .scene_file = scene_file.string(), .recording = 8, .capacity = 1U << 17U});
    game.room.watch(recorder);
    game.room.watch(then);
    game.join(0);
    // The value of the signal is positive in the first 12 steps and negative in the next 13. After that no value is
    // sent, so the signal becomes stale.
    for (int i = 0; i < 50; ++i) {
      const double value = i < 12 ? 0.5 : -0.5;
      if (i < 25) {
        game.command({.kind = server::RoomCommand::Kind::kSetSignal,
                      .signal_value = {value, 0.9, static_cast<std::uint32_t>(i)}});
      }
      game.run(0.1);
    }
    recorder.finish();
    EXPECT_EQ(recorder.steps_lost(), 0U);
    EXPECT_TRUE(game.status().has_called);
  }
  Progress now;
  const ReplayResult result = replay_session(file, {}, [&now](const server::Room& room) { now.add(room); });
  EXPECT_FALSE(result.differs_at_step.has_value()) << result.differing_thing;
  EXPECT_EQ(now.steps, then.steps);
  std::vector<int> levels;
  for (const auto& step : now.steps) {
    if (levels.empty() || levels.back() != std::get<2>(step)) levels.push_back(std::get<2>(step));
  }
  EXPECT_EQ(levels, (std::vector<int>{0, 1, 0})) << "positive, negative, and then without a signal the same";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tandem::lab

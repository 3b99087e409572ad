// Tests external signals in games: their age, conditions, decision tables and limits, and their state in a checkpoint.
#include "server/goals/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/goals/game_codec.hpp"
#include "server/recording/room_checkpoint.hpp"
#include "server/recording/step_codec.hpp"
#include "tests/server/goals/game_room.hpp"

namespace tandem::server {
namespace {

using Kind = GameEvent::Kind;
using ::testing::ElementsAre;

constexpr const char* kValence =
    R"("signals": [{"name": "valence", "max_age_s": 0.5, "min_confidence": 0.6, "states": [
         {"name": "negative", "below": -0.1}, {"name": "positive", "above": 0.1}]}])";
constexpr const char* kNeverHeld = R"({"in_region": {"body": "ball", "region": {"sphere": {"radius_m": 0.001}}}})";
constexpr const char* kInTheRoom = R"({"in_region": {"body": "ball", "region": {"sphere": {"radius_m": 1}}}})";

std::shared_ptr<const LoadedScene> scene_of_game(const std::string& game) {
  return test::scene_of(small_game(game));
}

void send(GameRoom& game, double value, double confidence = 1, std::uint32_t age_steps = 0) {
  ASSERT_TRUE(game.room.post({.kind = RoomCommand::Kind::kSetSignal, .signal_value = {value, confidence, age_steps}}));
}

/// Runs a game while a source sends a value every 0.1 s.
void run_with(GameRoom& game, double value, double seconds) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds * 10)); ++i) {
    send(game, value);
    game.run(0.1);
  }
}

std::shared_ptr<const LoadedScene> scene_with_condition(const std::string& condition) {
  return scene_of_game("{" + std::string(kValence) +
                       R"(, "levels": [{"name": "a", "goals": [{"name": "g", "hold_s": 0.2, "conditions": [)" +
                       kInTheRoom + R"(, {"signal": {"name": "valence", )" + condition + "}}]}]}]}");
}

TEST(Signals, AConditionHoldsWhileTheValueIsInItsRange) {
  GameRoom game(scene_with_condition(R"("above": 0.5)"));
  game.join(0);
  run_with(game, 0.4, 1);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
  EXPECT_EQ(game.status().goals[0].satisfied, 1);
  run_with(game, 0.6, 0.4);
  EXPECT_EQ(game.status().phase, GamePhase::kWon);
}

TEST(Signals, AStaleSignalDoesNotHinderAGoalUnlessItIsRequired) {
  for (const bool is_required : {false, true}) {
    GameRoom game(scene_with_condition(is_required ? R"("above": 0.5, "required": true)" : R"("above": 0.5)"));
    game.join(0);
    game.run(1);
    EXPECT_EQ(game.status().phase, is_required ? GamePhase::kPlaying : GamePhase::kWon) << is_required;
    EXPECT_FALSE(game.status().signals[0].is_fresh);
  }
}

TEST(Signals, AValueIsFreshUntilItsLargestAgeAndWithEnoughConfidence) {
  GameRoom game(scene_with_condition(R"("above": 2)"));
  const auto is_fresh = [&game] { return game.status().signals[0].is_fresh; };
  ASSERT_TRUE(game.room.post({.seat = {2, UserId{9}, UserRole::kObserver, 0}}));
  send(game, 0.5);
  game.run(0.499);
  EXPECT_TRUE(is_fresh()) << "also while the clock stands";
  EXPECT_EQ(game.status().signals[0].state, 2);
  game.run(0.003);
  EXPECT_FALSE(is_fresh());
  EXPECT_EQ(game.status().signals[0].state, 0);
  send(game, 0.5, 1, 400);
  game.run(0.099);
  EXPECT_TRUE(is_fresh());
  game.run(0.003);
  EXPECT_FALSE(is_fresh()) << "the age at the source counts";
  send(game, 0.5, 0.59);
  game.step();
  EXPECT_FALSE(is_fresh()) << "too little confidence";
  send(game, std::nan(""));
  game.step();
  EXPECT_EQ(game.status().signals[0].value, 0.5) << "a value that is not a number is ignored";
}

// A room without users must discard signal values. The age of a value is counted in steps, but an empty room may stop
// stepping for a time that no replay knows. The value would then seem too new.
TEST(Signals, AnEmptyRoomDiscardsValues) {
  GameRoom game(scene_with_condition(R"("above": 2)"));
  send(game, 0.5);
  game.step();
  EXPECT_FALSE(game.status().signals[0].has_value) << "nobody has joined";
  game.join(0);
  send(game, 0.5);
  game.step();
  EXPECT_TRUE(game.status().signals[0].is_fresh);
  game.leave(0);
  game.step();
  EXPECT_FALSE(game.status().signals[0].has_value);
  EXPECT_FALSE(game.status().signals[0].is_fresh);
  game.join(0);
  game.step();
  EXPECT_FALSE(game.status().signals[0].is_fresh) << "a value of before the stop has no age";
}

// Returns a game with the decision table of the source thesis.
std::string thesis_game(const std::string& more = "", const std::string& more_in_level = "") {
  const auto level = [&](const std::string& name, const std::string& same, const std::string& easier,
                         const std::string& lower, const std::string& higher) {
    return R"({"name": ")" + name + R"(", "time_limit_s": 2, "goals": [
        {"name": "held", "extra": true, "score": 5, "conditions": [{"held": {"body": "ball"}}]},
        {"name": "never", "conditions": [)" +
           kNeverHeld + R"(]}]
        )" +
           more_in_level + R"(, "next": {"signal": "valence", "high_score": 5, "rows": [
        {"score": "HIGH", "state": "negative", "level": ")" +
           easier + R"("}, {"score": "HIGH", "state": "positive", "level": ")" + higher +
           R"("}, {"score": "LOW", "state": "negative", "level": ")" + lower + R"("}, {"score": "LOW", "level": ")" +
           same + R"("}, {"score": "HIGH", "level": ")" + higher + R"("}]}})";
  };
  return "{" + std::string(kValence) + more + R"(, "levels": [)" + level("easy", "easy", "easy", "easy", "middle") +
         "," + level("middle", "middle", "friendly", "easy", "hard") + "," +
         level("friendly", "friendly", "friendly", "easy", "hard") + "," +
         level("hard", "hard", "hard", "middle", "hard") + "]}";
}
constexpr int kEasy = 0, kMiddle = 1, kFriendly = 2, kHard = 3;

struct Cell {
  bool is_high = false;
  double value = 0;    ///< value of the signal
  double seconds = 2;  ///< time for which the signal is sent, at most the 2 s of the level
  int next = 0;
};

class DecisionTable : public ::testing::TestWithParam<Cell> {};

TEST_P(DecisionTable, DeterminesTheNextLevel) {
  const Cell& cell = GetParam();
  GameRoom game(scene_of_game(thesis_game()));
  game.join(0);
  game.run(0.1);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = kMiddle});
  game.move(0, {0, 0, 0.035});
  game.hands[0].is_pressed = cell.is_high;
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = kMiddle});
  game.step();
  ASSERT_EQ(game.status().level, kMiddle);
  run_with(game, cell.value, cell.seconds);
  game.run(0.02);
  game.events.clear();
  while (game.status().level_steps > 5) game.step();
  EXPECT_EQ(game.status().level, cell.next);
  EXPECT_THAT(game.kinds(), ElementsAre(Kind::kLevelFailed, Kind::kLevelChosen, Kind::kLevelStarted));
  EXPECT_EQ(game.status().total(), cell.is_high ? 5 : 0) << "the score of the round counts although its time is over";
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying);
}

INSTANTIATE_TEST_SUITE_P(OfTheThesis, DecisionTable,
                         ::testing::Values(Cell{true, -0.5, 1.9, kFriendly}, Cell{true, 0.5, 1.9, kHard},
                                           Cell{false, -0.5, 1.9, kEasy}, Cell{false, 0.5, 1.9, kMiddle},
                                           // A state of the signal is dominant if it lasted for most of the level. In
                                           // these cases none is dominant, so the score alone decides.
                                           Cell{true, 0, 1.9, kHard}, Cell{false, 0, 1.9, kMiddle},
                                           Cell{true, -0.5, 0.4, kHard}, Cell{false, -0.5, 0.4, kMiddle},
                                           Cell{true, 0, 0, kHard}, Cell{false, 0, 0, kMiddle}));

TEST(Signals, AStateIsDominantAboveItsShareOfTheLevelsTime) {
  SignalStatus signal;
  signal.level_steps = {1000, 400, 0, 0};
  EXPECT_FALSE(dominant_state(signal, 2000, 0.5).has_value()) << "half of the time is not more than half";
  EXPECT_EQ(dominant_state(signal, 1999, 0.5), 0U);
  signal.level_steps = {0, 0, 0, 0};
  EXPECT_FALSE(dominant_state(signal, 0, 0.5).has_value());
}

TEST(Signals, ARowWithoutLevelWinsTheGame) {
  GameRoom game(scene_of_game(R"({"levels": [{"name": "a", "goals": [{"name": "g", "conditions": [)" +
                              std::string(kInTheRoom) +
                              R"(]}], "next": {"rows": [{"score": "HIGH"}, {"score": "LOW", "level": "a"}]}}]})"));
  game.join(0);
  game.run(1.1);
  EXPECT_THAT(game.kinds(), ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kGoalReached, Kind::kLevelReached,
                                        Kind::kLevelChosen, Kind::kWon));
}

TEST(Signals, ALevelThatFollowsItselfLastsASecondEachTime) {
  GameRoom game(scene_of_game(R"({"levels": [{"name": "a", "goals": [{"name": "g", "conditions": [)" +
                              std::string(kInTheRoom) + R"(]}], "next": {"rows": [{"level": "a"}]}}]})"));
  game.join(0);
  game.run(3.5);
  EXPECT_EQ(std::ranges::count(game.kinds(), Kind::kLevelChosen), 3);
  EXPECT_EQ(std::ranges::count(game.kinds(), Kind::kGoalReached), 4) << "the goal counts at once";
}

TEST(Signals, ALimitOfTheGameEndsItBeforeTheNextLevelIsEntered) {
  const std::string limit = R"(, "time_limit_s": 2, "call": {"at_time_limit": true})";
  GameRoom chosen(scene_of_game(thesis_game(limit)));
  chosen.join(0);
  chosen.run(2.5);
  EXPECT_THAT(chosen.kinds(),
              ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kLevelFailed, Kind::kCalled, Kind::kLost));
  GameRoom repeated(scene_of_game(R"({"time_limit_s": 1, "levels": [{"name": "a", "time_limit_s": 1, "repeats": true,
      "goals": [{"name": "g", "conditions": [)" +
                                  std::string(kNeverHeld) + "]}]}]}"));
  repeated.join(0);
  repeated.run(1.5);
  EXPECT_THAT(repeated.kinds(), ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kLevelFailed, Kind::kLost));
}

TEST(Signals, TheHashContainsTheCallAlsoOfAGameWithoutSignals) {
  GameStatus status;
  const std::uint32_t before = hash_of(status);
  status.has_called = true;
  EXPECT_NE(hash_of(status), before);
}

TEST(Signals, TheTimeOfTheGameEndsItAndCallsOnce) {
  GameRoom game(scene_of_game(thesis_game(R"(, "time_limit_s": 3, "call": {"at_time_limit": true})")));
  game.join(0);
  game.run(3.5);
  EXPECT_THAT(game.kinds(), ElementsAre(Kind::kStarted, Kind::kLevelStarted, Kind::kLevelFailed, Kind::kLevelChosen,
                                        Kind::kLevelStarted, Kind::kCalled, Kind::kLost));
  EXPECT_TRUE(game.events.back().by_time);
  EXPECT_EQ(game.status().steps, 3000U);
}

TEST(Signals, TheTimeInOneStateEndsTheGameAndCallsOnce) {
  const std::string limit =
      R"(, "state_limit": {"signal": "valence", "state": "negative", "limit_s": 2.5}, "call": {"at_state_limit": true})";
  GameRoom game(scene_of_game(thesis_game(limit)));
  game.join(0);
  game.run(0.1);
  run_with(game, -0.5, 1);
  run_with(game, 0.5, 2);
  run_with(game, -0.5, 1);
  EXPECT_EQ(game.status().phase, GamePhase::kPlaying) << "the total counts, and it is about 2.1 s";
  run_with(game, -0.5, 1);
  EXPECT_EQ(game.status().phase, GamePhase::kLost);
  EXPECT_TRUE(game.events.back().by_state);
  EXPECT_FALSE(game.events.back().by_time);
  EXPECT_EQ(game.status().signals[0].steps[0], 2500U);
  EXPECT_EQ(std::ranges::count(game.kinds(), Kind::kCalled), 1);
  game.run(1);
  game.command({.kind = RoomCommand::Kind::kStartLevel, .level = 0});
  game.run(0.1);
  EXPECT_EQ(game.status().signals[0].steps[0], 0U) << "another game begins";
  EXPECT_FALSE(game.status().has_called);
}

TEST(Signals, ACheckpointKeepsTheTimesInStates) {
  const auto scene = scene_of_game(thesis_game());
  GameRoom before(scene);
  before.join(0);
  run_with(before, -0.5, 0.8);
  const auto state = state_of(checkpoint_of(before.room), *scene);
  ASSERT_TRUE(state.has_value() && state->game.has_value());
  GameRoom after(scene);
  after.room.resume(*state);
  EXPECT_EQ(after.status().signals[0].steps, before.status().signals[0].steps);
  EXPECT_EQ(after.status().signals[0].level_steps, before.status().signals[0].level_steps);
  EXPECT_EQ(after.status().signals[0].steps[0], 800U);
  after.join(0);
  after.run(0.5);
  EXPECT_EQ(after.status().signals[0].steps[0], 800U) << "the old value is stale after the restart";
}

TEST(Signals, ACheckpointKeepsThatTheCallWasMade) {
  GameRoom game(scene_of_game(thesis_game()));
  for (const bool has_called : {true, false}) {
    GameStatus status = game.status();
    status.has_called = has_called;
    wire::GameCheckpoint message;
    write_checkpoint(status, message);
    const auto read = read_checkpoint(message);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->has_called, has_called);
  }
}

TEST(Signals, AnIdenticalSequenceGivesTheSameStatusInEachStep) {
  const auto scene = scene_of_game(thesis_game());
  std::vector<std::uint32_t> first;
  for (int run = 0; run < 2; ++run) {
    GameRoom game(scene);
    game.join(0);
    std::vector<std::uint32_t> hashes;
    for (int i = 0; i < 30; ++i) {
      send(game, i % 3 - 1, 0.9, static_cast<std::uint32_t>(i));
      for (int step = 0; step < 100; ++step) {
        game.step();
        hashes.push_back(hash_of(game.status()));
      }
    }
    if (run == 1) {
      EXPECT_EQ(hashes, first);
    }
    first = hashes;
  }
}

TEST(Signals, ARecordedValueIsReadBackAndAnImpossibleOneIsNot) {
  RoomCommand command{.kind = RoomCommand::Kind::kSetSignal, .signal = 3, .signal_value = {-0.25, 0.75, 120}};
  wire::RecordedCommand message = recorded(command);
  const auto read = command_of(message);
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->signal, 3);
  EXPECT_EQ(read->signal_value.value, -0.25);
  EXPECT_EQ(read->signal_value.confidence, 0.75);
  EXPECT_EQ(read->signal_value.age_steps, 120U);
  message.set_signal(kMaxSignals);
  EXPECT_FALSE(command_of(message).has_value());
}

}  // namespace
}  // namespace tandem::server

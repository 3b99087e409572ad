// Tests the client's reception of game messages: messages that do not fit the scene must be ignored.
#include "client/session/game_book.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace tandem::client {
namespace {

using ::testing::HasSubstr;

wire::Scene scene() {
  wire::Scene out;
  for (const char* const name : {"table", "ball", "cube"}) out.add_bodies()->set_name(name);
  wire::Level& level = *out.mutable_game()->add_levels();
  level.set_text("put the ball into the ring");
  level.add_goals()->set_text("ball in the ring");
  level.mutable_goals(0)->mutable_reached()->set_text("Well\ndone!");
  for (const double number : {0.1, 0.2, 0.3}) level.mutable_goals(0)->mutable_reached()->add_color_rgb(number);
  return out;
}

wire::GameState state() {
  wire::GameState out;
  out.add_goals();
  out.add_absent_bodies(3);
  for (const double number : {0.0, 0.0, -2.0}) out.add_gravity_m_per_s2(number);
  return out;
}

TEST(GameBook, AStateThatFitsTheSceneIsUsed) {
  GameBook book;
  book.begin(scene());
  EXPECT_EQ(book.report(), nullptr);
  ASSERT_TRUE(book.receive(state()));
  EXPECT_EQ(book.absent_bodies(), 0b100U);
  EXPECT_EQ(book.gravity_m_per_s2()->z(), -2);
  book.begin(scene());
  EXPECT_EQ(book.report(), nullptr);
  EXPECT_EQ(book.absent_bodies(), 0U);
}

TEST(GameBook, AStateThatDoesNotFitTheSceneChangesNothing) {
  const std::vector<std::function<void(wire::GameState&)>> changes{
      [](auto& state) { state.set_level(1); },
      [](auto& state) { state.add_goals(); },
      [](auto& state) { state.clear_goals(); },
      [](auto& state) { state.set_absent_bodies(0, 0); },
      [](auto& state) { state.set_absent_bodies(0, 4); },
      [](auto& state) { state.set_absent_bodies(0, 4'000'000'000U); },
      [](auto& state) { state.set_score(std::nan("")); },
      [](auto& state) { state.set_elapsed_s(-1); },
      [](auto& state) { state.set_level_elapsed_s(INFINITY); },
      [](auto& state) { state.mutable_goals(0)->set_elapsed_s(std::nan("")); },
      [](auto& state) { state.set_gravity_m_per_s2(1, 1e9); },
      [](auto& state) { state.add_gravity_m_per_s2(0); }};
  GameBook book;
  book.begin(scene());
  ASSERT_TRUE(book.receive(state()));
  const auto before = book.report();
  for (std::size_t i = 0; i < changes.size(); ++i) {
    wire::GameState changed = state();
    changes[i](changed);
    EXPECT_FALSE(book.receive(changed)) << i;
    EXPECT_EQ(book.report(), before) << i;
  }
  GameBook without;
  without.begin(wire::Scene());
  EXPECT_FALSE(without.receive(state()));
}

TEST(GameBook, AnEventHasTheTextOfTheSceneOrOneOfItsNames) {
  GameBook book;
  book.begin(scene());
  wire::GameEvent event;
  event.set_kind(wire::GameEvent::GOAL_REACHED);
  event.set_score(12.5);
  EXPECT_EQ(book.receive(event), "Well?done! (score 12.5)") << "a line break of the server is replaced";
  EXPECT_EQ(color_of(event, scene().game()).y(), 0.2);
  event.set_kind(wire::GameEvent::GOAL_FAILED);
  event.set_by_time(true);
  EXPECT_EQ(book.receive(event), "failed: ball in the ring: the time is over (score 12.5)");
  event.set_kind(wire::GameEvent::LEVEL_STARTED);
  EXPECT_EQ(book.receive(event), "level 1 of 1: put the ball into the ring");
  event.set_goal(1);
  EXPECT_EQ(book.receive(event), "");
  event.set_goal(0);
  event.set_level(1);
  EXPECT_EQ(book.receive(event), "");
}

TEST(GameBook, TheEventsOfOneStepAreShownTogether) {
  GameBook book;
  book.begin(scene());
  book.receive(state());
  EXPECT_TRUE(book.report()->last_events().empty());
  wire::GameEvent event;
  const auto receive = [&](std::uint64_t step, wire::GameEvent::Kind kind) {
    event.set_step(step);
    event.set_kind(kind);
    book.receive(event);
  };
  receive(1, wire::GameEvent::STARTED);
  receive(2, wire::GameEvent::CALLED);
  receive(2, wire::GameEvent::LOST);
  const auto last = book.report()->last_events();
  ASSERT_EQ(last.size(), 2U);
  EXPECT_EQ(last[0].kind(), wire::GameEvent::CALLED);
  EXPECT_EQ(last[1].kind(), wire::GameEvent::LOST);
  for (int i = 0; i < 20; ++i) receive(3, wire::GameEvent::GOAL_REACHED);
  EXPECT_EQ(book.report()->last_events().size(), kMaxEventsTogether);
}

TEST(GameBook, TheReportHasTheLastEvents) {
  GameBook book;
  book.begin(scene());
  wire::GameEvent event;
  book.receive(event);
  EXPECT_EQ(book.report(), nullptr) << "there is no report before the first state";
  book.receive(state());
  for (std::size_t i = 0; i < 2 * kMaxGameEvents; ++i) {
    event.set_step(i);
    book.receive(event);
  }
  EXPECT_EQ(book.report()->events.size(), kMaxGameEvents);
  EXPECT_EQ(book.report()->events.back().step(), 2 * kMaxGameEvents - 1);
}

}  // namespace
}  // namespace tandem::client

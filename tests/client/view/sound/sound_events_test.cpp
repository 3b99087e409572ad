#include "client/view/sound/sound_events.hpp"

#include <gtest/gtest.h>

#include <map>

namespace tandem::client {
namespace {

using std::chrono::milliseconds;

/// A session in virtual time, with 30 frames a second.
class SoundEventsTest : public testing::Test {
 protected:
  /// Runs the session for `span`. Returns how often each sound was requested.
  std::map<Sound, int> pass(Duration span) {
    std::map<Sound, int> counts;
    for (const LocalTime end = now_ + span; now_ < end; now_ += milliseconds(33)) {
      for (const SoundCue& cue : events_.follow(state_, now_)) {
        ++counts[cue.sound];
        last_gain_ = cue.gain;
      }
    }
    return counts;
  }
  static wire::GameEvent event(wire::GameEvent::Kind kind, std::uint64_t step) {
    wire::GameEvent event;
    event.set_kind(kind);
    event.set_step(step);
    return event;
  }

  using Counts = std::map<Sound, int>;
  SoundEvents events_;
  SoundState state_{.is_touching = false};
  LocalTime now_{milliseconds(7000)};
  double last_gain_ = 0;
};

TEST_F(SoundEventsTest, ATouchIsHeardOnce) {
  EXPECT_EQ(pass(milliseconds(500)), Counts{});
  state_.is_touching = true;
  EXPECT_EQ(pass(milliseconds(2000)), (Counts{{Sound::kContact, 1}}));
  state_.is_touching = false;
  EXPECT_EQ(pass(milliseconds(500)), Counts{});
  state_.is_touching = true;
  EXPECT_EQ(pass(milliseconds(500)), (Counts{{Sound::kContact, 1}}));
}

TEST_F(SoundEventsTest, AToolThatSlidesOverAnEdgeIsOneTouch) {
  pass(milliseconds(100));
  int count = 0;
  for (int i = 0; i < 40; ++i) {
    state_.is_touching = i % 2 == 0;
    count += pass(milliseconds(50))[Sound::kContact];
  }
  EXPECT_EQ(count, 1);
}

TEST_F(SoundEventsTest, WhereContactsAreNotKnownASuddenForceIsHeard) {
  state_.is_touching.reset();
  pass(milliseconds(500));
  state_.force_n = 1.5;
  EXPECT_EQ(pass(milliseconds(1000)), (Counts{{Sound::kContact, 1}})) << "a lasting force is one contact";
  state_.force_n = 0;
  pass(milliseconds(500));
  for (int i = 0; i < 30; ++i, state_.force_n += 0.05) EXPECT_EQ(pass(milliseconds(100)), Counts{}) << "a slow press";
}

TEST_F(SoundEventsTest, AHarderContactIsLouderWithinBounds) {
  state_.is_touching.reset();
  pass(milliseconds(500));
  state_.force_n = 0.8;
  pass(milliseconds(500));
  const double soft = last_gain_;
  state_.force_n = 0;
  pass(milliseconds(500));
  state_.force_n = 3;
  pass(milliseconds(500));
  EXPECT_GT(last_gain_, soft);
  state_.force_n = 1e6;
  pass(milliseconds(500));
  EXPECT_LE(last_gain_, 1);
}

TEST_F(SoundEventsTest, ARingingForceIsHeardAtALimitedRate) {
  state_.is_touching.reset();
  pass(milliseconds(500));
  int count = 0;
  for (int i = 0; i < 60; ++i) {
    state_.force_n = i % 2 == 0 ? 6 : 0;
    count += pass(milliseconds(33))[Sound::kContact];
  }
  EXPECT_GT(count, 2);
  EXPECT_LE(count, 2000 / 80 + 1);
}

TEST_F(SoundEventsTest, AForceThatReturnsAfterAFaultIsSilent) {
  state_.is_touching.reset();
  pass(milliseconds(500));
  state_.is_ramping = true;
  state_.force_n = 3;
  EXPECT_EQ(pass(milliseconds(500)), Counts{});
  state_.is_ramping = false;
  EXPECT_EQ(pass(milliseconds(500)), Counts{});
}

TEST_F(SoundEventsTest, GraspAndReleaseAreHeardButNotABodyHeldFromTheStart) {
  state_.held_body = BodyId{2};
  EXPECT_EQ(pass(milliseconds(200)), Counts{});
  state_.held_body = BodyId{};
  EXPECT_EQ(pass(milliseconds(200)), (Counts{{Sound::kRelease, 1}}));
  state_.held_body = BodyId{3};
  EXPECT_EQ(pass(milliseconds(200)), (Counts{{Sound::kGrasp, 1}}));
}

TEST_F(SoundEventsTest, GoalsAreHeardOnceAndOnlyThoseSinceTheJoin) {
  GameReport game;
  state_.game = &game;
  game.events = {event(wire::GameEvent::GOAL_REACHED, 100)};
  EXPECT_EQ(pass(milliseconds(200)), Counts{}) << "before the user joined";
  game.events.push_back(event(wire::GameEvent::GOAL_REACHED, 5000));
  EXPECT_EQ(pass(milliseconds(200)), (Counts{{Sound::kGoal, 1}}));
  game.events.push_back(event(wire::GameEvent::LEVEL_STARTED, 5001));
  EXPECT_EQ(pass(milliseconds(200)), Counts{});
  game.events.push_back(event(wire::GameEvent::GOAL_FAILED, 6000));
  game.events.push_back(event(wire::GameEvent::LOST, 6000));
  EXPECT_EQ(pass(milliseconds(200)), (Counts{{Sound::kFailure, 1}})) << "two events of a frame are one sound";
  state_.game = nullptr;
  EXPECT_EQ(pass(milliseconds(200)), Counts{});
}

TEST_F(SoundEventsTest, TheFirstGoalOfAGameWithoutEventsIsHeard) {
  GameReport game;
  state_.game = &game;
  pass(milliseconds(200));
  game.events = {event(wire::GameEvent::WON, 9000)};
  EXPECT_EQ(pass(milliseconds(200)), (Counts{{Sound::kGoal, 1}}));
}

}  // namespace
}  // namespace tandem::client

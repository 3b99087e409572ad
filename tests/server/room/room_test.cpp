// Tests the data between users and a room: commands, inputs, buttons, updates and events.
#include "server/room/room.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "server/recording/room_recorder.hpp"
#include "tests/common/physics/scene_support.hpp"
#include "tests/support/allocation_counter.hpp"

namespace tandem::server {
namespace {

constexpr const char* kRoomTwoCubes =
    R"({"name": "floor", "shapes": [{"box": {"size_m": [1, 1, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}},
       {"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
        "placement": {"position_m": [0, 0, 0.02]}},
       {"name": "b", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2,
        "placement": {"position_m": [0.2, 0, 0.02]}})";
constexpr const char* kRoomTwoTools =
    R"({"name": "l", "placement": {"position_m": [0, 0, 0.05]}}, {"name": "r", "placement": {"position_m": [0.5, 0, 0.3]}})";

class RoomTest : public ::testing::Test {
 protected:
  RoomTest() : room_(RoomId{1}, "test", physics::load_parts({.bodies = kRoomTwoCubes, .tools = kRoomTwoTools})) {}

  void post(RoomCommand::Kind kind, std::uint8_t seat, std::uint32_t user, std::uint32_t request = 0,
            BodyId body = {}) {
    ASSERT_TRUE(room_.post({.kind = kind, .seat = {seat, UserId{user}}, .body = body, .request = request}));
  }
  void join(std::uint8_t seat, std::uint32_t user, std::uint8_t tool) {
    ASSERT_TRUE(room_.post({.seat = {seat, UserId{user}, UserRole::kManipulator, tool}}));
  }
  void observe(std::uint8_t seat, std::uint32_t user) { post(RoomCommand::Kind::kJoin, seat, user); }

  void send(std::uint8_t seat, const Vec3& p, std::uint32_t buttons = 0, bool is_valid = true) {
    proto::ClientUpdate update;
    update.input_tick = Tick{++ticks_};
    update.handle.X.p = p;
    update.handle_valid = is_valid;
    update.buttons = buttons;
    update.sent = LocalTime(Duration(static_cast<Duration::rep>(1000 * ticks_)));
    room_.input(seat).publish(update);
  }
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) room_.step(ServerTime(room_.period() * static_cast<Duration::rep>(++steps_)));
  }
  /// Returns the newest update for a seat; nothing if none was published since the last call.
  std::optional<proto::ServerUpdate> update(std::uint8_t seat) {
    room_.output().poll();
    const RoomUpdate& received = room_.output().front();
    if (!received.user[seat].is_valid() || received.own[seat].step == received_[seat]) return std::nullopt;
    received_[seat] = received.own[seat].step;
    return received.for_seat(seat);
  }
  std::optional<RoomEvent> event() {
    RoomEvent event;
    if (!room_.next_event(event)) return std::nullopt;
    return event;
  }

  Room room_;
  std::uint64_t ticks_ = 0;
  std::uint64_t steps_ = 0;
  std::array<Step, proto::kMaxUsers> received_;
};

TEST_F(RoomTest, OnlyOccupiedSlotsAreSent) {
  join(3, 7, 0);
  step();
  EXPECT_TRUE(update(3).has_value());
  EXPECT_FALSE(update(0).has_value());
  post(RoomCommand::Kind::kLeave, 3, 7);
  step();
  EXPECT_FALSE(update(3).has_value());
}

/// Counts the completed steps of a room.
struct StepCounter final : RoomWatcher {
  void on_command(const RoomCommand& /*command*/) noexcept override {}
  void on_input(std::size_t /*seat*/, const proto::ClientUpdate& /*input*/) noexcept override {}
  void on_step(const Room& /*room*/, ServerTime /*now*/, TickFaults /*faults*/) noexcept override { ++steps; }
  int steps = 0;
};

TEST_F(RoomTest, UsersAreAnsweredBeforeTheStepIsFinished) {
  StepCounter counter;
  room_.watch(counter);
  join(0, 7, 0);
  step();
  send(0, {0, 0, 0.06});
  room_.answer(ServerTime(room_.period() * 2));
  const auto answer = update(0);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->answered_input, Tick{1});
  EXPECT_EQ(counter.steps, 1) << "the step must continue";
  room_.finish();
  EXPECT_EQ(counter.steps, 2);
  EXPECT_FALSE(update(0).has_value()) << "there is one answer a step";
}

TEST_F(RoomTest, UpdateAnswersTheNewestInput) {
  join(0, 7, 0);
  send(0, {0, 0, 0.05});
  send(0, {0, 0, 0.06});
  step();
  const auto received = update(0);
  ASSERT_TRUE(received.has_value());
  EXPECT_EQ(received->step, Step{1});
  EXPECT_EQ(received->stepped, ServerTime(room_.period()));
  // An input that a former user has left in the seat's mailbox must be discarded when a user joins.
  EXPECT_EQ(received->answered_input, Tick{0});
  send(0, {0, 0, 0.06});
  step();
  const auto next = update(0);
  EXPECT_EQ(next->answered_input, Tick{3});
}

TEST_F(RoomTest, BodiesAreAllThatMoveAndUsersAreTheOthers) {
  join(0, 7, 0);
  join(1, 8, 1);
  observe(2, 9);
  step();
  const auto first = update(0);
  ASSERT_EQ(first->bodies.size(), 2U) << "the floor does not move";
  EXPECT_EQ(first->bodies[0].id, BodyId{2});
  ASSERT_EQ(first->users.size(), 1U) << "neither oneself nor observers";
  EXPECT_EQ(first->users[0].id, UserId{8});
  EXPECT_EQ(first->users[0].tool.X.p, Vec3(0.5, 0, 0.3));
  EXPECT_EQ(update(2)->users.size(), 2U) << "an observer sees both";
}

TEST_F(RoomTest, GrabCommandIsAnsweredAndSeenByAll) {
  join(0, 7, 0);
  join(1, 8, 1);
  step();
  post(RoomCommand::Kind::kGrab, 0, 7, 42);
  step();
  const auto answer = event();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->kind, RoomEvent::Kind::kGrabbed);
  EXPECT_EQ(answer->request, 42U);
  EXPECT_EQ(answer->body, BodyId{2});
  EXPECT_EQ(update(0)->held_body, BodyId{2});
  const auto other = update(1);
  EXPECT_EQ(other->bodies[0].held_by, UserId{7});
  EXPECT_EQ(other->users[0].holds, BodyId{2});
  post(RoomCommand::Kind::kRelease, 0, 7, 43);
  step();
  EXPECT_EQ(event()->kind, RoomEvent::Kind::kReleased);
  EXPECT_FALSE(update(0)->held_body.is_valid());
}

TEST_F(RoomTest, ARefusedGrabHasAReason) {
  join(0, 7, 0);
  for (const auto& [body, reason] : {std::pair{BodyId{3}, physics::GrabResult::kNotGraspable},
                                     std::pair{BodyId{9}, physics::GrabResult::kUnknownBody}}) {
    post(RoomCommand::Kind::kGrab, 0, 7, 5, body);
    step();
    const auto answer = event();
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(answer->kind, RoomEvent::Kind::kGrabRefused);
    EXPECT_EQ(answer->refusal, reason);
  }
}

TEST_F(RoomTest, TheGrabButtonGrabsOnPressAndReleasesOnRelease) {
  join(0, 7, 0);
  step();
  send(0, {0, 0, 0.05}, kButtonGrab);
  step();
  EXPECT_EQ(update(0)->held_body, BodyId{2});
  send(0, {0, 0, 0.05}, kButtonGrab);
  step();
  EXPECT_EQ(event()->kind, RoomEvent::Kind::kGrabbed);
  EXPECT_FALSE(event().has_value()) << "holding it down is not a second press";
  send(0, {0, 0, 0.05}, 0);
  step();
  EXPECT_EQ(event()->kind, RoomEvent::Kind::kReleased);
  EXPECT_FALSE(update(0)->held_body.is_valid());
}

TEST_F(RoomTest, LeavingReleasesTheHeldBody) {
  join(0, 7, 0);
  join(1, 8, 1);
  post(RoomCommand::Kind::kGrab, 0, 7);
  step();
  ASSERT_EQ(update(1)->bodies[0].held_by, UserId{7});
  post(RoomCommand::Kind::kLeave, 0, 7);
  step();
  const auto left = update(1);
  EXPECT_FALSE(left->bodies[0].held_by.is_valid());
  EXPECT_TRUE(left->users.empty());
}

TEST_F(RoomTest, CommandOfAFormerUserDoesNotTouchTheNext) {
  join(0, 7, 0);
  post(RoomCommand::Kind::kLeave, 0, 7);
  join(0, 8, 0);
  post(RoomCommand::Kind::kGrab, 0, 7, 5);
  post(RoomCommand::Kind::kLeave, 0, 7);
  step();
  EXPECT_FALSE(event().has_value());
  EXPECT_TRUE(update(0).has_value());
}

TEST_F(RoomTest, ObserverMovesNothing) {
  observe(0, 7);
  post(RoomCommand::Kind::kGrab, 0, 7, 5);
  step();
  send(0, {0, 0, 0.02}, kButtonGrab);
  step(10);
  EXPECT_FALSE(event().has_value());
  EXPECT_EQ(update(0)->tick_faults, 0U);
}

TEST_F(RoomTest, ImpossibleCommandsAreIgnored) {
  join(0, 7, 200);
  join(255, 8, 0);
  post(RoomCommand::Kind::kGrab, 77, 9);
  step();
  EXPECT_FALSE(update(0).has_value());
}

TEST_F(RoomTest, InputIsStaleAfter115Milliseconds) {
  join(1, 8, 1);
  step();
  send(1, {0.5, 0, 0.3});
  step(116);
  EXPECT_EQ(update(1)->tick_faults & kFaultInputStale, 0U);
  step();
  EXPECT_NE(update(1)->tick_faults & kFaultInputStale, 0U);
  send(1, {0.5, 0, 0.3});
  step();
  EXPECT_EQ(update(1)->tick_faults & kFaultInputStale, 0U);
}

TEST_F(RoomTest, StaleOrInvalidHandleIsNotPulledTo) {
  join(1, 8, 1);
  step();
  send(1, {0.52, 0, 0.3});
  step(5);
  EXPECT_GT(update(1)->wrench_on_hand_W.f.norm(), 1);
  send(1, {9, 9, 9}, 0, false);
  step(2);
  EXPECT_EQ(update(1)->wrench_on_hand_W.f.norm(), 0);
  step(500);
  EXPECT_LT((update(1)->tool.X.p - Vec3(0.5, 0, 0.3)).norm(), 0.03);
}

TEST_F(RoomTest, FaultsAreReportedOnce) {
  observe(0, 7);
  room_.report(kFaultOverrun);
  step();
  EXPECT_EQ(update(0)->tick_faults, static_cast<TickFaults>(kFaultOverrun));
  step();
  EXPECT_EQ(update(0)->tick_faults, 0U);
}

TEST_F(RoomTest, LostEventsAreCounted) {
  join(0, 7, 0);
  for (int i = 0; i < 300; ++i) {
    post(RoomCommand::Kind::kGrab, 0, 7, 1, BodyId{9});
    step();
  }
  EXPECT_EQ(room_.events_lost(), 300U - 256U);
}

TEST_F(RoomTest, OneUsersFloodOfGrabsIsAnsweredBusyAndOthersAreServedInTheSameStep) {
  join(0, 7, 0);
  join(1, 8, 1);
  step();
  for (std::uint32_t i = 0; i < 40; ++i) post(RoomCommand::Kind::kGrab, 0, 7, 100 + i);
  post(RoomCommand::Kind::kRelease, 0, 7, 140);
  post(RoomCommand::Kind::kRelease, 1, 8, 200);
  step();
  const auto first = event();
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->kind, RoomEvent::Kind::kGrabbed);
  EXPECT_EQ(first->request, 100U);
  for (std::uint32_t i = 1; i <= 40; ++i) {
    const auto refused = event();
    ASSERT_TRUE(refused.has_value()) << i;
    EXPECT_EQ(refused->refusal, physics::GrabResult::kBusy) << i;
    EXPECT_EQ(refused->request, 100 + i);
  }
  const auto other = event();
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ(other->kind, RoomEvent::Kind::kReleased);
  EXPECT_EQ(other->request, 200U);
  EXPECT_EQ(update(0)->held_body, BodyId{2}) << "the release of that step was refused";
}

TEST_F(RoomTest, AStepAppliesABoundedNumberOfCommands) {
  join(0, 7, 0);
  for (int i = 1; i < kMaxCommandsPerStep; ++i) post(RoomCommand::Kind::kSetCoupling, 0, 99);
  observe(1, 8);
  step();
  EXPECT_FALSE(update(1).has_value()) << "one over the bound";
  step();
  EXPECT_TRUE(update(1).has_value());
}

TEST_F(RoomTest, AButtonPressBesideACommandHasItsTurnWithTheNextInput) {
  join(0, 7, 0);
  step();
  post(RoomCommand::Kind::kRelease, 0, 7, 5);
  send(0, {0, 0, 0.05}, kButtonGrab);
  step();
  EXPECT_FALSE(update(0)->held_body.is_valid());
  send(0, {0, 0, 0.05}, kButtonGrab);
  step();
  EXPECT_EQ(update(0)->held_body, BodyId{2});
}

TEST_F(RoomTest, UpdatesContainTheirReceiverAndTheNumberOfServedRequests) {
  join(0, 7, 0);
  post(RoomCommand::Kind::kGrab, 0, 7, 1);
  post(RoomCommand::Kind::kRelease, 0, 7, 0);
  step();
  ASSERT_TRUE(update(0).has_value());
  EXPECT_EQ(room_.output().front().user[0], UserId{7});
  EXPECT_EQ(room_.output().front().requests_served[0], 2U);
  post(RoomCommand::Kind::kLeave, 0, 7);
  join(0, 8, 0);
  step();
  ASSERT_TRUE(update(0).has_value());
  EXPECT_EQ(room_.output().front().user[0], UserId{8});
  EXPECT_EQ(room_.output().front().requests_served[0], 0U);
}

TEST(Room, StepDoesNotAllocateInSteadyContact) {
  Room room(RoomId{1}, "test", physics::load_parts({.bodies = kRoomTwoCubes, .tools = kRoomTwoTools}));
  RoomCommand join;
  join.seat.user = UserId{7};
  join.seat.role = UserRole::kManipulator;
  ASSERT_TRUE(room.post(join));
  double from_hand_j = 0;
  const auto step_pressing = [&](int count) {
    for (int i = 0; i < count; ++i) {
      proto::ClientUpdate update;
      update.handle.X.p = {0.001 * std::sin(0.01 * i), 0, 0.035};
      update.handle_valid = true;
      update.energy_from_hand_j = from_hand_j += 1e-4;
      room.input(0).publish(update);
      room.step(ServerTime(room.period()));
    }
  };
  step_pressing(1000);
  const std::uint64_t before = test::allocation_count();
  step_pressing(1000);
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_GT(room.world().tool(0).wrench_on_hand_W.f.z(), 1) << "the tool presses on a cube";
}

TEST_F(RoomTest, OurOwnPartOfAStepDoesNotAllocateEvenWhenItGrabs) {
  // The recorder must not allocate either, not even when its ring overflows, as it does in this test.
  const auto file =
      std::filesystem::temp_directory_path() / ("tandem_room_test" + std::to_string(::getpid()) + ".mcap");
  std::filesystem::remove(file);
  RoomRecorder recorder(room_, {.file = file, .program = "test", .recording = 1, .capacity = 1000});
  room_.watch(recorder);
  join(0, 7, 0);
  join(1, 8, 1);
  observe(2, 9);
  send(0, {0, 0, 0.05});
  step(100);
  const std::uint64_t before = test::allocation_count();
  for (int i = 0; i < 400; ++i) {
    send(0, {0, 0, 0.045}, i % 100 < 50 ? kButtonGrab : 0U);
    send(1, {0.5, 0.001 * i, 0.3});
    step();
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_EQ(event()->kind, RoomEvent::Kind::kGrabbed) << "the steps above must have done something";
  recorder.finish();
  std::filesystem::remove(file);
  EXPECT_GT(recorder.file().messages_written(), 200U);
  EXPECT_GT(recorder.steps_lost(), 0U);
}

TEST_F(RoomTest, AnEmptyRoomIsIdleAndAsItWas) {
  EXPECT_TRUE(room_.is_idle()) << "no user has joined";
  join(0, 7, 0);
  EXPECT_FALSE(room_.is_idle()) << "a user is joining";
  step();
  EXPECT_FALSE(room_.is_idle());
}

TEST_F(RoomTest, StartsAnewWhenAllHaveBeenAwayForAWhile) {
  join(0, 7, 0);
  send(0, {0, 0, 0.05});
  step();
  post(RoomCommand::Kind::kGrab, 0, 7, 1, BodyId{2});
  for (int i = 0; i < 300; ++i) {
    send(0, {0, 1e-3 * i, 0.05});
    step();
  }
  post(RoomCommand::Kind::kLeave, 0, 7);
  step(29'000);
  EXPECT_FALSE(room_.is_idle()) << "30 s unless the scene says otherwise";
  EXPECT_GT(room_.world().body(BodyId{2}).X.p.y(), 0.02) << "where it was left";
  step(1'100);
  EXPECT_TRUE(room_.is_idle());
  EXPECT_LT((room_.world().body(BodyId{2}).X.p - Vec3(0, 0, 0.02)).norm(), 1e-3);
  join(1, 8, 1);
  step();
  EXPECT_TRUE(update(1).has_value()) << "users must be able to join again";
}

TEST(RoomWithoutReset, KeepsItsStateAndSleeps) {
  Room room(RoomId{1}, "test",
            physics::load_parts(
                {.bodies = kRoomTwoCubes, .tools = kRoomTwoTools, .rest = R"("limits": {"reset_after_s": 0})"}));
  ASSERT_TRUE(room.post({.seat = {0, UserId{7}, UserRole::kManipulator, 0}}));
  room.step(ServerTime{});
  ASSERT_TRUE(room.post({.kind = RoomCommand::Kind::kLeave, .seat = {0, UserId{7}}}));
  EXPECT_FALSE(room.is_idle()) << "the leave is not executed yet";
  room.step(ServerTime{});
  EXPECT_TRUE(room.is_idle());
}

TEST(RoomBounds, AllUsersAreNotifiedOfABodyThatIsPutBack) {
  const std::string falling = R"({"name": "a", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2})";
  Room room(RoomId{1}, "test",
            physics::load_parts({.bodies = falling, .tools = kRoomTwoTools, .rest = R"("limits": {"bounds_m": 0.8})"}));
  RoomEvent event;
  int steps = 0;
  while (!room.next_event(event) && steps < 1000) {
    room.step(ServerTime{});
    ++steps;
  }
  EXPECT_EQ(event.kind, RoomEvent::Kind::kReturned);
  EXPECT_EQ(event.body, BodyId{1});
  EXPECT_EQ(room.world().body(BodyId{1}).X.p, Vec3(0, 0, 0));
}

TEST_F(RoomTest, AResetMovesAllBodiesBackAndNotifiesTheirHolders) {
  join(0, 7, 0);
  join(1, 8, 1);
  step();
  send(0, {0, 0, 0.05}, kButtonGrab);
  step();
  const auto grabbed = event();
  ASSERT_TRUE(grabbed);
  ASSERT_EQ(grabbed->body, BodyId{2});
  for (int i = 0; i < 400; ++i) {
    send(0, {0, 0, 0.05 + 2e-4 * i}, kButtonGrab);
    step();
  }
  ASSERT_GT(room_.world().body(BodyId{2}).X.p.z(), 0.03);
  post(RoomCommand::Kind::kReset, 1, 8);
  step();
  EXPECT_LT((room_.world().body(BodyId{2}).X.p - Vec3(0, 0, 0.02)).norm(), 1e-3);
  EXPECT_FALSE(update(0)->held_body.is_valid());
  const auto released = event();
  ASSERT_TRUE(released);
  EXPECT_EQ(released->kind, RoomEvent::Kind::kReleased);
  EXPECT_EQ(released->user, UserId{7});
  for (const std::uint32_t body : {2U, 3U}) {
    const auto back = event();
    ASSERT_TRUE(back);
    EXPECT_EQ(back->kind, RoomEvent::Kind::kReturned);
    EXPECT_EQ(back->body, BodyId{body});
  }
  step(100);
  EXPECT_FALSE(event()) << "once";
}

}  // namespace
}  // namespace tandem::server

// Tests the passivity controller of a tool in the room: a hand that supplies energy can move bodies, a hand that
// supplies none cannot.
#include <gtest/gtest.h>

#include <cmath>

#include "server/room/room.hpp"
#include "tests/common/physics/scene_support.hpp"

namespace tandem::server {
namespace {

constexpr const char* kRoomPassivityFloatingBox =
    R"({"name": "box", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.5, "graspable": true,
        "gravity": false})";
constexpr const char* kTool = R"({"name": "t", "placement": {"position_m": [-0.02, 0, 0]}})";
/// Largest energy that a fling of 1.5 s may create beyond the work that the hand supplies. It is the energy debt at
/// which the brake reaches its full force (−kMinBalance_j), plus the leak in 1.5 s.
constexpr double kMaxCreated_j =
    -haptics::ToolPassivityController::kMinBalance_j + 1.5 * haptics::ToolPassivityController::kLeakRate_w;

/// A user grasps the box and flings it at 0.6 m/s, which takes 90 mJ.
class Flung {
 public:
  explicit Flung(bool controls_tool_passivity, proto::ClientMode mode = proto::ClientMode::kHandle)
      : mode_(mode),
        room_(RoomId{1}, "test", physics::load_parts({.bodies = kRoomPassivityFloatingBox, .tools = kTool}),
              {.controls_tool_passivity = controls_tool_passivity}) {
    EXPECT_TRUE(room_.post({.seat = {0, UserId{1}, UserRole::kManipulator}}));
  }

  /// Runs a fling. The client reports only the fraction `supplied_share` of the true work of the hand. The true work is
  /// computed from the wrench along the handle's path.
  void run(double supplied_share) {
    for (std::uint64_t tick = 1; tick <= 1500; ++tick) {
      proto::ClientUpdate input;
      input.input_tick = Tick{tick};
      input.sent = LocalTime(std::chrono::milliseconds(tick));
      const double moving_s = 1e-3 * std::max(0.0, static_cast<double>(tick) - 500);
      input.handle.X.p.x() = -0.02 + 0.6 * moving_s;
      input.handle.V.v.x() = moving_s > 0 ? 0.6 : 0;
      input.handle_valid = true;
      input.buttons = kButtonGrab;
      input.mode = mode_;
      const double work_j = update_.wrench_on_hand_W.f.dot(input.handle.X.p - handle_p_);
      handle_p_ = input.handle.X.p;
      (work_j > 0 ? to_hand_j_ : from_hand_j_) += supplied_share * std::abs(work_j);
      input.energy_from_hand_j = from_hand_j_;
      input.energy_to_hand_j = to_hand_j_;
      room_.input(0).publish(input);
      const Vec3 before_W = room_.world().tool(0).tool.X.p;
      room_.step(ServerTime(std::chrono::milliseconds(tick)));
      tool_way_m_ += (room_.world().tool(0).tool.X.p - before_W).norm();
      room_.output().poll();
      update_ = room_.output().front().own[0];
      faults_ |= update_.tick_faults;
      const double injected_j = update_.energy_into_world_j - update_.energy_from_world_j;
      created_max_j_ = std::max(created_max_j_, injected_j - (from_hand_j_ - to_hand_j_));
      ASSERT_TRUE(is_finite(update_.wrench_on_hand_W)) << tick;
    }
  }
  /// Sends invalid handles for 0.2 s. Meanwhile the room holds the box at its pose.
  void lose_hand() { rest(200, false); }
  /// Simulates a hostile client: in each step the hand rests, but the client reports additional work of `work_j`.
  void claim_at_rest(int steps, double work_j) {
    for (int i = 0; i < steps; ++i) {
      from_hand_j_ += work_j;
      rest(1, true);
    }
  }
  /// Lets the hand rest for 1.5 s at the distance `away_m` from the present pose of the tool.
  void begin_at(double away_m) {
    handle_p_ = room_.world().tool(0).tool.X.p + Vec3(0, away_m, 0);
    rest(1500, true);
  }
  double way_to_handle_m() const { return (room_.world().tool(0).tool.X.p - handle_p_).norm(); }
  double kinetic_j() const { return 0.25 * room_.world().body(BodyId{1}).V.v.squaredNorm(); }
  double created_max_j() const { return created_max_j_; }
  /// Returns the largest work that the coupling can have done so far: its force limit times the length of the tool's
  /// path.
  double max_pull_j() const { return room_.world().coupling(0).force_limit_n * tool_way_m_; }
  double braked_j() const { return room_.braked_j(); }
  bool is_held() const { return update_.held_body.is_valid(); }
  bool was_limited() const { return (faults_ & kFaultToolEnergyLimited) != 0; }
  const haptics::ToolPassivityController& controller() const { return room_.tool_passivity(0); }

 private:
  void rest(int steps, bool is_valid) {
    for (int i = 0; i < steps; ++i) {
      proto::ClientUpdate input;
      input.input_tick = Tick{++rest_ticks_};
      input.sent = LocalTime(std::chrono::milliseconds(rest_ticks_));
      input.handle.X.p = handle_p_;
      input.handle_valid = is_valid;
      input.buttons = kButtonGrab;
      input.mode = mode_;
      input.energy_from_hand_j = from_hand_j_;
      input.energy_to_hand_j = to_hand_j_;
      room_.input(0).publish(input);
      room_.step(ServerTime(std::chrono::milliseconds(rest_ticks_)));
    }
  }

  std::uint64_t rest_ticks_ = 1500;
  proto::ClientMode mode_;
  Room room_;
  proto::OwnUpdate update_;
  TickFaults faults_ = 0;
  Vec3 handle_p_{-0.02, 0, 0};
  double from_hand_j_ = 0;
  double to_hand_j_ = 0;
  double created_max_j_ = 0;
  double tool_way_m_ = 0;
};

TEST(RoomPassivity, AHandThatSuppliesTheEnergyFlingsTheBox) {
  for (const proto::ClientMode mode : {proto::ClientMode::kHandle, proto::ClientMode::kLocalModel}) {
    Flung flung(true, mode);
    flung.run(1);
    EXPECT_TRUE(flung.is_held());
    EXPECT_NEAR(flung.kinetic_j(), 0.09, 0.005);
    EXPECT_FALSE(flung.was_limited());
    EXPECT_EQ(flung.braked_j(), 0);
    EXPECT_EQ(flung.controller().dropped_reports(), 0U);
  }
}

TEST(RoomPassivity, AHandThatSuppliesNothingHardlyMovesIt) {
  Flung flung(true);
  flung.run(0);
  EXPECT_TRUE(flung.is_held());
  EXPECT_LE(flung.created_max_j(), kMaxCreated_j);
  EXPECT_LE(flung.kinetic_j(), kMaxCreated_j);
  EXPECT_TRUE(flung.was_limited()) << "the limit must be reported to users";
}

TEST(RoomPassivity, WorkReportedByAHandAtRestIsNotCredited) {
  Flung flung(true);
  flung.claim_at_rest(1500, 0.01);
  EXPECT_LE(flung.controller().balance_j(), haptics::EnergyReport::kMaxUnclaimed_j + 1e-3) << "of 15 J";
}

/// The hand reports no work. The handle moves away, and the coupling pulls with almost its maximum force. The brake
/// must dissipate the work of this pull, and no more.
TEST(RoomPassivity, TheBrakeDissipatesTheWorkOfThePull) {
  Flung flung(true);
  flung.run(0);
  EXPECT_GT(flung.braked_j(), 0.5 * flung.max_pull_j());
  EXPECT_LE(flung.braked_j(), 1.01 * flung.max_pull_j());
}

TEST(RoomPassivity, AHandThatSuppliesHalfCreatesLittle) {
  Flung flung(true, proto::ClientMode::kLocalModel);
  flung.run(0.5);
  EXPECT_LE(flung.created_max_j(), kMaxCreated_j);
  EXPECT_TRUE(flung.was_limited());
}

TEST(RoomPassivity, AHandleThatWasLostAndIsElsewhereMovesTheBoxThere) {
  Flung flung(true);
  flung.run(1);
  flung.lose_hand();
  flung.begin_at(0.05);
  EXPECT_LT(flung.way_to_handle_m(), 0.001) << "a body at rest has no hand that supplies energy";
}

TEST(RoomPassivity, WithoutItNoSupplyIsNeeded) {
  Flung flung(false);
  flung.run(0);
  EXPECT_NEAR(flung.kinetic_j(), 0.09, 0.005);
  EXPECT_FALSE(flung.was_limited());
}

}  // namespace
}  // namespace tandem::server

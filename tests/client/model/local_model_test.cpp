// Tests the local model against a server's world, with a queue as delay. Without other users, the hand must feel the
// same force as without a delay.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "client/model/local_model.hpp"
#include "client/model/local_world.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/physics/followed_bodies.hpp"
#include "proto/world_from_wire.hpp"

namespace tandem::client {
namespace {

constexpr Duration kPeriod{std::chrono::milliseconds(1)};
constexpr BodyId kBlock = body_id_at(1);

physics::TouchModel touch_of(std::shared_ptr<const contact::ContactShape> shape) {
  return proto::touch_model_of({{std::move(shape), Pose{}}}, 1e10);
}

MassProperties cube_mass(double mass_kg, double edge_m) {
  MassProperties mass;
  mass.mass_kg = mass_kg;
  mass.principal_inertia_kg_m2 = Vec3::Constant(mass_kg * edge_m * edge_m / 6);
  return mass;
}

/// A table with its top at z = 0 and a block of 0.5 kg on it. A tool with a spherical tip is at each of two opposite
/// sides of the block.
std::shared_ptr<physics::WorldDescription> scene() {
  auto world = std::make_shared<physics::WorldDescription>();
  physics::BodyDescription table;
  static const auto plate = contact::make_contact_box({0.3, 0.3, 0.02});
  table.touch = touch_of(plate);
  table.X_WB.p.z() = -0.01;
  physics::BodyDescription block;
  static const auto box = contact::make_contact_box(Vec3::Constant(0.04));
  block.touch = touch_of(box);
  block.mass = cube_mass(0.5, 0.04);
  block.X_WB.p = {0, 0, 0.02};
  block.traits.friction = 0.1;
  block.is_graspable = true;
  world->bodies = {table, block};
  for (const double side : {-1.0, 1.0}) {
    physics::ToolDescription tool;
    static const auto ball = contact::make_contact_sphere(0.005);
    tool.touch = touch_of(ball);
    tool.mass = cube_mass(0.03, 0.04);
    tool.X_WT.p = {side * 0.04, 0, 0.02};
    world->tools.push_back(tool);
  }
  world->coupling.law = "spring-damper";
  world->coupling.parameters.stiffness_n_per_m = 500;
  world->coupling.parameters.damping_n_s_per_m = 5;
  return world;
}

std::size_t index_of_law(std::string_view name) {
  return static_cast<std::size_t>(haptics::find_coupling_law(name) - haptics::coupling_laws().data());
}

RigidState at(const Vec3& p, const Vec3& v = Vec3::Zero()) {
  return {{p, Quat::Identity()}, {v, Vec3::Zero()}};
}

/// A server's world and one client's local model of it, with a fixed delay in each direction.
class Across {
 public:
  Across(const std::shared_ptr<const physics::WorldDescription>& world, int one_way_ticks,
         const LocalModelSettings& settings = {})
      : server(world, physics::make_followed_bodies(world->bodies.size()), nullptr),
        model(world, 0, settings),
        one_way_(static_cast<std::size_t>(one_way_ticks)),
        one_way_up_(one_way_) {
    scene_.coupling = world->coupling.parameters;
    scene_.law = index_of_law(world->coupling.law);
    server.activate_tool(0);
  }

  /// Lets another user join with tool 1. Their hand receives the force of the server's coupling.
  void join_partner(const RigidState& handle) {
    server.activate_tool(1);
    server.set_tool(1, handle);
    partner_ = handle;
  }
  void move_partner(const RigidState& handle) { partner_ = handle; }
  /// Stops or restarts the partner's updates.
  void silence_partner(bool is_silent) { partner_is_silent_ = is_silent; }
  /// Starts or ends a gap in which no input reaches the server. In the gap, the server extrapolates the pose of the
  /// hand and confirms each tick at the time at which its input was due.
  void lose_inputs(bool is_gap) { is_gap_ = is_gap; }
  /// Limits the rate of the received states to one state per `ticks` ticks, from the next tick on.
  void receive_each(int ticks) { receive_each_ = ticks; }
  /// Increases the delay to the server by `ticks`.
  void lengthen(int ticks) { one_way_up_ += static_cast<std::size_t>(ticks); }
  void lose_partner() {
    server.deactivate_tool(1);
    partner_.reset();
  }

  /// Runs one tick of the client and of the server. Returns the wrench on the client's hand.
  Wrench tick(const RigidState& handle, std::uint32_t buttons = 0) {
    ++tick_.value;
    up_.push_back({tick_, handle, buttons});
    if (up_.size() > one_way_up_) {
      if (!is_gap_) input_ = up_.front();
      ran_on_ = is_gap_ ? ran_on_ + 1 : 0;
      up_.pop_front();
    }
    if (input_.tick.value != 0) receive_input();
    if (partner_ && !partner_is_silent_) server.set_handle(1, *partner_);
    if (partner_is_silent_) server.clear_handle(1);
    server.step();
    down_.push_back(update());
    LocalModelInput input;
    if (down_.size() > one_way_) {
      if (tick_.value % static_cast<std::uint64_t>(receive_each_) == 0) {
        newest_.update = down_.front();
        newest_.received = now();
        has_newest_ = true;
        input.is_new = true;
      }
      down_.pop_front();
    }
    input.input = tick_;
    input.now = now();
    input.handle = handle;
    input.buttons = buttons;
    input.newest = has_newest_ ? &newest_ : nullptr;
    input.scene = &scene_;
    return (next_ ? *next_ : model).step(input);
  }
  /// Replaces the local model by another model of the same scene. The new model continues from the state of the old
  /// one.
  void switch_world(const std::shared_ptr<const physics::WorldDescription>& world) {
    next_.emplace(world, 0, LocalModelSettings{});
    next_->continue_from(model, scene_);
  }
  void set_gravity(const Vec3& m_per_s2) {
    server.set_gravity(m_per_s2);
    scene_.gravity_m_per_s2 = m_per_s2;
  }
  /// Removes bodies from the scene.
  /// In      bodies  bit i is set if body i does not exist in the present level of the game
  void set_absent(std::uint64_t bodies) { scene_.absent_bodies = bodies; }
  LocalModel& newest_model() { return next_ ? *next_ : model; }

  physics::World server;
  LocalModel model;

 private:
  struct Input {
    Tick tick;
    RigidState handle;
    std::uint32_t buttons = 0;
  };

  void receive_input() {
    server.set_handle(0, input_.handle);
    const bool is_down = (input_.buttons & kButtonGrab) != 0;
    if (is_down && !was_down_) server.grab(0, BodyId{});
    if (!is_down && was_down_) server.release(0);
    was_down_ = is_down;
  }

  proto::ServerUpdate update() {
    proto::ServerUpdate sent;
    sent.step.value = tick_.value;
    sent.stepped = ServerTime{now().time_since_epoch()};
    sent.answered_input.value = input_.tick.value + ran_on_;
    sent.echoed_sent = LocalTime{kPeriod * static_cast<int>(input_.tick.value)};
    const physics::ToolState tool = server.tool(0);
    sent.tool = tool.tool;
    sent.wrench_on_hand_W = tool.wrench_on_hand_W;
    sent.held_body = tool.held;
    if (tool.held.is_valid()) sent.X_BT = server.body(tool.held).X.inverse() * tool.tool.X;
    if (partner_) {
      const physics::ToolState other = server.tool(1);
      sent.users.push_back({.id = UserId{2},
                            .tool = other.tool,
                            .holds = other.held,
                            .tool_index = 1,
                            .has_handle = other.has_handle,
                            .handle = other.handle,
                            .handle_age = Duration{0},
                            .on_hand_W = other.wrench_on_hand_W});
    }
    sent.bodies.push_back({kBlock, server.body(kBlock), UserId{}});
    return sent;
  }

  std::optional<LocalModel> next_;

  LocalTime now() const { return LocalTime{kPeriod * static_cast<int>(tick_.value)}; }

  HapticScene scene_;
  std::size_t one_way_;     ///< delay from the server to the client [ticks]
  std::size_t one_way_up_;  ///< delay from the client to the server [ticks]
  Tick tick_;
  std::deque<Input> up_;
  std::deque<proto::ServerUpdate> down_;
  Input input_;
  std::optional<RigidState> partner_;  ///< pose of the partner's hand; empty without a partner
  bool partner_is_silent_ = false;
  bool is_gap_ = false;
  int receive_each_ = 1;
  std::uint64_t ran_on_ = 0;
  ReceivedUpdate newest_;
  bool has_newest_ = false;
  bool was_down_ = false;
};

/// Moves the hand from the tool's start to `end` in 1 s, and holds it there for 1 s. Returns the wrench of each tick.
std::vector<Wrench> felt(Across& across, const Vec3& start, const Vec3& end) {
  std::vector<Wrench> wrenches;
  for (int k = 0; k < 400; ++k) across.tick(at(start));
  for (int k = 0; k <= 2000; ++k) {
    const double share = std::min(1.0, k / 1000.0);
    const Vec3 v = k < 1000 ? Vec3(end - start) : Vec3(Vec3::Zero());
    wrenches.push_back(across.tick(at(start + share * (end - start), v)));
  }
  return wrenches;
}

double largest_difference_n(const std::vector<Wrench>& a, const std::vector<Wrench>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i].f - b[i].f).norm());
  return largest;
}

class LocalModelDelay : public testing::TestWithParam<int> {};

TEST_P(LocalModelDelay, AStaticBodyFeelsLikeWithoutDelay) {
  const Vec3 start{-0.04, 0, 0.02}, pressed{-0.1, 0, -0.01};
  Across near(scene(), 1), far(scene(), GetParam());
  const auto without_far = felt(near, start, pressed), with = felt(far, start, pressed);
  EXPECT_GT(without_far.back().f.norm(), 3);
  // Both worlds receive the same inputs in the same order, so the forces must be equal at any delay.
  EXPECT_LT(largest_difference_n(without_far, with), 1e-3);
}

TEST_P(LocalModelDelay, ABodyThatOnlyThisUserPushesIsFeltAsWithoutADelay) {
  const Vec3 start{-0.04, 0, 0.02}, pushed{0.06, 0, 0.02};
  Across near(scene(), 1), far(scene(), GetParam());
  const auto without_far = felt(near, start, pushed), with = felt(far, start, pushed);
  double most = 0;
  for (const Wrench& wrench : without_far) most = std::max(most, wrench.f.norm());
  EXPECT_GT(most, 0.4);
  EXPECT_LT(largest_difference_n(without_far, with), 0.05);
  // Model and server must agree once the block is at rest and the server's updates have arrived.
  EXPECT_NEAR(far.model.body(kBlock).X.p.x(), far.server.body(kBlock).X.p.x(), 5e-4);
}

TEST_P(LocalModelDelay, AWrongMassIsReconciledWithoutOscillation) {
  LocalModelSettings settings;
  settings.errors.mass_scale = 0.6;
  const Vec3 start{-0.04, 0, 0.02}, pushed{0.06, 0, 0.02};
  Across far(scene(), GetParam(), settings);
  const auto forces = felt(far, start, pushed);
  for (int k = 0; k < 1500; ++k) far.tick(at(pushed));
  EXPECT_NEAR(far.model.body(kBlock).X.p.x(), far.server.body(kBlock).X.p.x(), 1e-3);
  EXPECT_LT(far.model.body(kBlock).V.v.norm(), 1e-3);
}

TEST_P(LocalModelDelay, AGraspIsPredictedAndThenTheServers) {
  Across far(scene(), GetParam());
  const Vec3 start{-0.04, 0, 0.02}, beside{-0.026, 0, 0.02}, lifted{-0.026, 0, 0.06};
  for (int k = 0; k < 700; ++k) far.tick(at(start));
  for (int k = 0; k < 1000; ++k) far.tick(at(start + std::min(1.0, k / 500.0) * (beside - start)));
  far.tick(at(beside), kButtonGrab);
  EXPECT_EQ(far.model.held(), kBlock);
  for (int k = 0; k < 2 * GetParam() + 20; ++k) far.tick(at(beside), kButtonGrab);
  EXPECT_EQ(far.server.tool(0).held, kBlock);
  EXPECT_EQ(far.model.held(), kBlock);
  Wrench wrench;
  for (int k = 0; k < 3000; ++k) {
    wrench = far.tick(at(beside + std::min(1.0, k / 1000.0) * (lifted - beside)), kButtonGrab);
  }
  EXPECT_NEAR(wrench.f.z(), -0.5 * 9.81, 0.1);
  EXPECT_NEAR((far.model.body(kBlock).X.p - far.server.body(kBlock).X.p).norm(), 0, 1e-3);
  far.tick(at(lifted));
  EXPECT_FALSE(far.model.held().is_valid());
}

TEST_P(LocalModelDelay, AReleaseDelayedByAGapIsNotReverted) {
  Across far(scene(), GetParam());
  const Vec3 start{-0.04, 0, 0.02}, beside{-0.026, 0, 0.02};
  for (int k = 0; k < 700; ++k) far.tick(at(start));
  for (int k = 0; k < 1000; ++k) far.tick(at(start + std::min(1.0, k / 500.0) * (beside - start)));
  for (int k = 0; k < 2 * GetParam() + 20; ++k) far.tick(at(beside), kButtonGrab);
  ASSERT_EQ(far.server.tool(0).held, kBlock);
  // The inputs in transit are lost, among them the release of the button. The server therefore still holds the body.
  far.lose_inputs(true);
  for (int k = 0; k < 2 * GetParam() + 60; ++k) {
    ASSERT_EQ(far.server.tool(0).held, kBlock);
    far.tick(at(beside));
    ASSERT_FALSE(far.model.held().is_valid()) << k << ": the server has answered later ticks, but received no button";
  }
  far.lose_inputs(false);
  far.tick(at(beside));
  EXPECT_FALSE(far.server.tool(0).held.is_valid());
}

INSTANTIATE_TEST_SUITE_P(OneWay, LocalModelDelay, testing::Values(5, 150));

TEST(LocalModel, FollowsABodyThatOthersMove) {
  auto world = scene();
  Across far(world, 50);
  const Vec3 start{-0.3, 0, 0.02};
  for (int k = 0; k < 500; ++k) far.tick(at(start));
  for (int k = 0; k < 1000; ++k) {
    far.server.set_body(kBlock, at({0.1e-3 * k, 0, 0.02}, {0.1, 0, 0}));
    far.tick(at(start));
  }
  // Fails with a lag of 5 mm if the body is not extrapolated to the current time by its velocity.
  EXPECT_NEAR(far.model.body(kBlock).X.p.x(), far.server.body(kBlock).X.p.x(), 1e-3);
}

TEST(LocalModel, ABodyPressedByAPartnerFromTheOtherSideDoesNotGiveWay) {
  for (const int one_way_ticks : {12, 50, 150}) {
    Across far(scene(), one_way_ticks);
    const Vec3 start{-0.04, 0, 0.02}, beside{-0.025, 0, 0.02};
    far.join_partner(at({0.025, 0, 0.02}));
    for (int k = 0; k < 500; ++k) far.tick(at(start));
    for (int k = 0; k < 500; ++k) far.tick(at(start + k / 500.0 * (beside - start)));
    // The couplings of both users act on the block in series, and the partner's hand does not move. The user's coupling
    // therefore takes up half of the displacement. Fails if this fraction depends on the delay.
    Wrench wrench;
    double farthest_m = 0;
    for (int k = 0; k < 6000; ++k) {
      const double way_m = 0.01 * std::min(1.0, k / 300.0);
      wrench = far.tick(at(beside + Vec3(way_m, 0, 0)));
      farthest_m = std::max(farthest_m, far.model.body(kBlock).X.p.x());
    }
    const double true_n = far.server.tool(0).wrench_on_hand_W.f.x();
    EXPECT_NEAR(true_n, -2.5, 0.5) << "with friction on the table";
    EXPECT_NEAR(wrench.f.x(), true_n, 0.05) << one_way_ticks;
    EXPECT_NEAR(far.model.body(kBlock).X.p.x(), far.server.body(kBlock).X.p.x(), 2e-4) << one_way_ticks;
    EXPECT_LT(farthest_m, 0.02) << "pushed away";
  }
}

TEST(LocalModel, ABodyHeldByAPartnerDoesNotFallWhenTouched) {
  for (const int one_way_ticks : {12, 50}) {
    Across far(scene(), one_way_ticks);
    far.join_partner(at({0, 0, 0.1}));
    far.server.set_body(kBlock, at({0, 0, 0.1}));
    far.server.hold(1, kBlock, Pose{});
    const Vec3 start{-0.04, 0, 0.1}, touching{-0.0245, 0, 0.1};
    for (int k = 0; k < 1500; ++k) far.tick(at(start));
    const double before_m = far.model.body(kBlock).X.p.z();
    EXPECT_NEAR(before_m, far.server.body(kBlock).X.p.z(), 3e-4);
    double lowest_m = before_m;
    Wrench wrench;
    for (int k = 0; k < 1000; ++k) {
      wrench = far.tick(at(start + std::min(1.0, k / 300.0) * (touching - start)));
      lowest_m = std::min(lowest_m, far.model.body(kBlock).X.p.z());
    }
    EXPECT_LT(wrench.f.x(), -0.05) << "it was not touched, so nothing was tested";
    EXPECT_NEAR(lowest_m, before_m, 1e-3) << one_way_ticks;
  }
}

// In the scene, tool 1 holds the block at an initial pose; since then the block has moved. Fails if the model resets
// the block to the initial pose when the partner's updates resume.
TEST(LocalModel, ASilentPartnerResumesWithTheHeldBodyWhereItIs) {
  const auto world = scene();
  world->tools[1].holds_body = 1;
  Across far(world, 50);
  far.join_partner(at({0, 0, 0.1}));
  far.server.set_body(kBlock, at({0, 0, 0.1}));
  far.server.hold(1, kBlock, Pose{});
  for (int k = 0; k < 800; ++k) far.tick(at({-0.023, 0, 0.1}));
  double largest_step_m = 0;
  for (int k = 0; k < 600; ++k) {
    const Vec3 before = far.model.body(kBlock).X.p;
    far.silence_partner(k >= 100 && k < 160);
    far.tick(at({-0.023, 0, 0.1}));
    largest_step_m = std::max(largest_step_m, (far.model.body(kBlock).X.p - before).norm());
  }
  EXPECT_EQ(far.server.tool(1).held, kBlock);
  EXPECT_LT(largest_step_m, 0.002) << "its start is 70 mm below";
}

TEST(LocalModel, TwoUsersShareTheWeightOfAHeldBodyAsAtTheServer) {
  Across far(scene(), 50);
  far.join_partner(at({0.02, 0, 0.06}));
  far.server.set_body(kBlock, at({0, 0, 0.06}));
  far.server.hold(1, kBlock, {{0.02, 0, 0}, Quat::Identity()});
  const Vec3 beside{-0.026, 0, 0.06};
  for (int k = 0; k < 1500; ++k) far.tick(at(beside));
  Wrench wrench;
  for (int k = 0; k < 3000; ++k) {
    wrench = far.tick(at(beside + Vec3(0, 0, 0.02 * std::min(1.0, k / 500.0))), kButtonGrab);
  }
  EXPECT_TRUE(far.model.held().is_valid());
  const Wrench true_W = far.server.tool(0).wrench_on_hand_W;
  EXPECT_LT(true_W.f.z(), -1) << "a part of the weight";
  EXPECT_LT((wrench.f - true_W.f).norm(), 0.1);
}

TEST(LocalModel, APartnerWhoHasLeftTouchesNothing) {
  Across far(scene(), 20);
  far.join_partner(at({0.024, 0, 0.02}));
  for (int k = 0; k < 500; ++k) far.tick(at({-0.04, 0, 0.02}));
  far.lose_partner();
  for (int k = 0; k < 1200; ++k) far.tick(at({-0.04, 0, 0.02}));
  // The pushed block moves through the space where the partner's tool was. Fails if the model still collides with that
  // tool.
  for (int k = 0; k < 1000; ++k) far.tick(at({-0.04 + 0.06 * k / 1000, 0, 0.02}));
  EXPECT_GT(far.model.body(kBlock).X.p.x(), 0.03);
  EXPECT_NEAR(far.model.body(kBlock).X.p.x(), far.server.body(kBlock).X.p.x(), 5e-3);
}

/// Holds the server's tool 30 mm away from the handle. Returns the number of ticks until the model is reset to that
/// tool.
int ticks_to_reset(Across& across) {
  const Vec3 handle{-0.04, 0, 0.02};
  for (int k = 0; k < 600; ++k) across.tick(at(handle));
  across.model.pop_jump();
  for (int k = 1; k < 3000; ++k) {
    across.server.set_tool(0, at(handle + Vec3(0, 0, 0.03)));
    across.tick(at(handle));
    if (across.model.pop_jump()) return k;
  }
  return 3000;
}

TEST(LocalModel, ADivergenceIsResetAfterTheSameTimeAtAnyRateOfTheStates) {
  constexpr int kOneWay = 10, kDivergence = 100;
  for (const int each : {1, 5, 10, 20}) {
    Across across(scene(), kOneWay);
    across.receive_each(each);
    // The tolerance is one interval between states, for two errors:
    // - The first state that differs arrives up to one interval late.
    // - The model counts the whole interval before this state as divergence.
    EXPECT_NEAR(ticks_to_reset(across), kOneWay + kDivergence, each + 2) << each << " ms between states";
  }
}

TEST(LocalModel, OneStateAfterASilenceIsNoDivergence) {
  Across across(scene(), 10);
  across.receive_each(200);
  EXPECT_GT(ticks_to_reset(across), 3 * 200) << "four states must differ";
}

TEST(LocalModel, TheLoopDelayFollowsALongerRouteInTheSameTimeAtAnyRateOfTheStates) {
  for (const int each : {1, 10}) {
    Across across(scene(), 20);
    across.receive_each(each);
    for (int k = 0; k < 3000; ++k) across.tick(at({-0.06, 0, 0.02}));
    const double before_s = to_seconds(across.model.loop_delay());
    across.lengthen(60);
    for (int k = 0; k < 60 + 500; ++k) across.tick(at({-0.06, 0, 0.02}));
    const double after_half_a_second_s = to_seconds(across.model.loop_delay());
    for (int k = 0; k < 6000; ++k) across.tick(at({-0.06, 0, 0.02}));
    const double end_s = to_seconds(across.model.loop_delay());
    EXPECT_GT(end_s - before_s, 0.05);
    EXPECT_GT((after_half_a_second_s - before_s) / (end_s - before_s), 0.4) << each << " ms between states";
  }
}

TEST(LocalModel, DisplaysNothingBeforeTheFirstServerState) {
  LocalModel model(scene(), 0);
  LocalModelInput input;
  input.input = Tick{1};
  input.handle = at({1, 0, 0});
  EXPECT_EQ(model.step(input).f.norm(), 0);
  EXPECT_FALSE(model.has_started());
}

TEST(LocalModel, AReceivedSoftContactIsFeltWithoutAForceStep) {
  auto world = scene();
  LocalModel model(world, 0);
  ReceivedUpdate newest;
  newest.update.tool = at(world->tools[0].X_WT.p);
  LocalModelInput input;
  input.handle = newest.update.tool;
  input.newest = &newest;
  HapticScene wanted;
  wanted.coupling = world->coupling.parameters;
  wanted.law = index_of_law(world->coupling.law);
  input.scene = &wanted;
  double before = 0, steepest = 0;
  for (std::uint64_t k = 1; k < 500; ++k) {
    input.input = Tick{k};
    input.now = LocalTime{kPeriod * static_cast<int>(k)};
    input.is_new = k == 100;
    if (k == 100) {
      newest.update.soft_contact.wrench_W.f = {0, 0, 1};
      newest.update.soft_contact.X_WT0 = newest.update.tool.X;
      newest.update.soft_contact.trust_radius_m = 0.05;
    }
    const double force = -model.step(input).f.z();
    steepest = std::max(steepest, std::abs(force - before));
    before = force;
  }
  EXPECT_NEAR(std::abs(before), 1, 0.01);
  // The force changes by 1 N through a critically damped filter with the time constant τ = 50 ms. Its slope is at most
  // 1 N / (e τ) = 0.0074 N per tick. Mass and coupling of the tool reduce the slope further.
  EXPECT_LT(steepest, 0.01);
}

TEST(LocalWorld, OneThatThisMachineCannotStepInTimeIsRefused) {
  const auto world = std::make_shared<const physics::WorldDescription>();
  EXPECT_NO_THROW(require_in_time(world, std::chrono::hours(1)));
  try {
    require_in_time(world, Duration{-1});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("ms on this machine, and may take"));
  }
}

/// Pose of a hand that pushes the block for 0.4 s and then rests.
RigidState pushing(int tick) {
  const double x = -0.04 + 0.05 * std::min(tick, 400) / 400.0;
  return at({x, 0, 0.02}, {tick < 400 ? 0.125 : 0.0, 0, 0});
}

TEST(LocalModel, ContinuesUnchangedInAnotherModelOfTheScene) {
  const auto world = scene();
  Across one(world, 30), other(world, 30);
  double apart_n = 0, apart_m = 0, force_n = 0;
  for (int tick = 0; tick < 1200; ++tick) {
    if (tick == 350) other.switch_world(world);  // during the push
    const Wrench felt = one.tick(pushing(tick));
    const Wrench felt_by_other = other.tick(pushing(tick));
    apart_n = std::max(apart_n, (felt.f - felt_by_other.f).norm());
    apart_m = std::max(apart_m, (one.model.body(kBlock).X.p - other.newest_model().body(kBlock).X.p).norm());
    force_n = std::max(force_n, felt.f.norm());
  }
  EXPECT_GT(force_n, 0.5);
  EXPECT_LT(apart_n, 0.05 * force_n);
  EXPECT_LT(apart_m, 5e-4);
}

TEST(LocalModel, ContinuesInAnotherModelWithTheHeldBody) {
  const auto world = scene();
  Across across(world, 30);
  for (int tick = 0; tick < 300; ++tick) across.tick(at({-0.025, 0, 0.02}), tick > 100 ? kButtonGrab : 0U);
  ASSERT_EQ(across.model.held(), kBlock);
  const Vec3 before = across.model.body(kBlock).X.p;
  across.switch_world(world);
  for (int tick = 0; tick < 50; ++tick) across.tick(at({-0.025, 0, 0.02}), kButtonGrab);
  EXPECT_EQ(across.newest_model().held(), kBlock);
  EXPECT_LT((across.newest_model().body(kBlock).X.p - before).norm(), 1e-3);
  EXPECT_GT(across.newest_model().loop_delay(), std::chrono::milliseconds(50))
      << "the new model must keep the measured delay";
}

TEST(LocalModel, ContinuesInAnotherModelWithTheGravityOfTheGame) {
  const auto world = scene();
  Across across(world, 10);
  const auto lifted = [](int tick) {
    return at({-0.025, 0, 0.02 + 0.03 * std::clamp((tick - 300) / 300.0, 0.0, 1.0)});
  };
  Wrench felt;
  for (int tick = 0; tick < 1000; ++tick) felt = across.tick(lifted(tick), tick > 100 ? kButtonGrab : 0U);
  ASSERT_GT(std::abs(felt.f.z()), 4) << "the weight of 0.5 kg";
  across.set_gravity(Vec3::Zero());
  for (int tick = 1000; tick < 2000; ++tick) felt = across.tick(lifted(tick), kButtonGrab);
  ASSERT_LT(felt.f.norm(), 0.2);
  across.switch_world(world);
  double most_n = 0;
  for (int tick = 2000; tick < 2400; ++tick) {
    most_n = std::max(most_n, across.tick(lifted(tick), kButtonGrab).f.norm());
  }
  EXPECT_LT(most_n, 0.4);
}

TEST(LocalModel, ABodyThatTheLevelTakesFromTheHandIsAJumpToBlend) {
  Across across(scene(), 10);
  for (int tick = 0; tick < 300; ++tick) across.tick(at({-0.025, 0, 0.02}), tick > 100 ? kButtonGrab : 0U);
  ASSERT_EQ(across.model.held(), kBlock);
  across.model.pop_jump();
  across.set_absent(std::uint64_t{1} << (kBlock.value - 1));
  across.tick(at({-0.025, 0, 0.02}), kButtonGrab);
  EXPECT_TRUE(across.model.pop_jump());
  for (int tick = 0; tick < 50; ++tick) across.tick(at({-0.025, 0, 0.02}), kButtonGrab);
  EXPECT_FALSE(across.model.held().is_valid()) << "late states with the body in the hand do not restore it";
}

TEST(LocalModel, AStaticBodyThatALevelRemovesIsAJumpToBlend) {
  Across across(scene(), 10);
  for (int tick = 0; tick < 300; ++tick) across.tick(at({-0.06, 0, 0.02}));
  across.model.pop_jump();
  across.set_absent(1);
  across.tick(at({-0.06, 0, 0.02}));
  EXPECT_TRUE(across.model.pop_jump());
  across.tick(at({-0.06, 0, 0.02}));
  EXPECT_FALSE(across.model.pop_jump());
}

TEST(LocalModel, DoesNotGoOnFromAModelOfAnotherScene) {
  const auto world = scene();
  Across across(world, 10);
  for (int tick = 0; tick < 100; ++tick) across.tick(at({-0.06, 0, 0.02}));
  auto smaller = scene();
  smaller->bodies.pop_back();
  across.switch_world(smaller);
  EXPECT_FALSE(across.newest_model().has_started());
}

}  // namespace
}  // namespace tandem::client

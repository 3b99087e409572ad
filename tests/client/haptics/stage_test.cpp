// Compares the stages with closed forms, and checks that force and reaction sum to zero.
#include "client/haptics/stages/stage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "client/haptics/stages/makers.hpp"
#include "common/base/random.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::client {
namespace {

haptics::CouplingParameters unlimited() {
  haptics::CouplingParameters parameters;
  parameters.stiffness_n_per_m = 500;
  parameters.damping_n_s_per_m = 2;
  parameters.stiffness_n_m_per_rad = 0.4;
  parameters.damping_n_m_s_per_rad = 0.01;
  parameters.force_limit_n = 1e3;
  parameters.torque_limit_n_m = 1e3;
  return parameters;
}

/// A stage input together with the coupling and the server state to which it refers.
struct StageRig {
  StageRig() {
    input.newest = &received;
    input.coupling = coupling.get();
    input.parameters = &parameters;
  }
  StageRig(const StageRig&) = delete;
  StageRig& operator=(const StageRig&) = delete;

  haptics::CouplingParameters parameters = unlimited();
  std::unique_ptr<haptics::CouplingLaw> coupling = haptics::make_coupling_law("spring-damper", unlimited());
  ReceivedUpdate received;
  proto::ServerUpdate& newest = received.update;
  StageInput input;
};

TEST(LatePose, IsASpringAndDamperBetweenHandleAndNewestTool) {
  StageRig rig;
  rig.input.handle.X = {Vec3(0.01, 0, 0), quaternion_of(Vec3(0, 0, 0.2))};
  rig.input.handle.V = {Vec3(0, 0.1, 0), Vec3(0, 0, 1)};
  rig.newest.tool.V.v = Vec3(0, 0, 0.2);
  const auto stage = make_stage({.name = "late-pose"});
  const Wrench on_hand = stage->tick(rig.input).wrench_on_hand_W;
  // The handle rotates at 1 rad/s, and its origin moves at 0.1 m/s. The tool is 0.01 m from this origin, so the
  // handle's point at the tool moves at 0.1 − 0.01 m/s. In the message, d is the displacement and Δv the relative
  // velocity.
  EXPECT_LT((on_hand.f - Vec3(-5.0, -0.18, 0.4)).norm(), 1e-12) << "−(500 d + 2 Δv)";
  const Vec3 lever = Vec3(0.01, 0, 0).cross(-on_hand.f);
  EXPECT_LT((on_hand.t - lever - Vec3(0, 0, -(0.4 * 0.2 + 0.01 * 1))).norm(), 1e-12);
}

TEST(LatePose, PairOnHandAndToolSumsToZero) {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : 17;
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto vector = [&random](double scale) {
    return Vec3(scale * Vec3(random.normal(), random.normal(), random.normal()));
  };
  StageRig rig;
  const auto stage = make_stage({.name = "late-pose"});
  for (int i = 0; i < 1000; ++i) {
    rig.input.handle = {{vector(0.05), quaternion_of(vector(0.5))}, {vector(0.3), vector(3)}};
    rig.newest.tool = {{vector(0.05), quaternion_of(vector(0.5))}, {vector(0.3), vector(3)}};
    const Wrench on_hand = stage->tick(rig.input).wrench_on_hand_W;
    const RigidState& tool = rig.newest.tool;
    const RigidState& handle = rig.input.handle;
    const Wrench on_tool = rig.coupling->wrench_on_tool_W(haptics::coupling_state(handle.X, handle.V, tool.X, tool.V));
    const Vec3 moment_about_T = on_tool.t + on_hand.t + (handle.X.p - tool.X.p).cross(on_hand.f);
    ASSERT_EQ(on_hand.f + on_tool.f, Vec3::Zero());
    ASSERT_LT(moment_about_T.norm(), 1e-12);
  }
}

TEST(LatePose, IsZeroAtTheToolAndWithoutAnyState) {
  StageRig rig;
  rig.input.handle.X.p = rig.newest.tool.X.p = Vec3(1, 2, 3);
  const auto stage = make_stage({.name = "late-pose"});
  EXPECT_TRUE(stage->tick(rig.input).wrench_on_hand_W.f.isZero(0));
  rig.input.newest = nullptr;
  rig.input.handle.X.p = Vec3::Zero();
  EXPECT_TRUE(stage->tick(rig.input).wrench_on_hand_W.f.isZero(0));
}

TEST(LatePose, OfALawWithoutASpringShowsTheServersWrench) {
  StageRig rig;
  const auto direct = haptics::make_coupling_law("direct", unlimited());
  rig.input.coupling = direct.get();
  rig.input.handle.X.p = Vec3(0.01, 0, 0);
  rig.newest.wrench_on_hand_W = {Vec3(1, 2, 3), Vec3(0.1, 0.2, 0.3)};
  const auto stage = make_stage({.name = "late-pose"});
  EXPECT_EQ(stage->tick(rig.input).wrench_on_hand_W.f, rig.newest.wrench_on_hand_W.f);
  EXPECT_EQ(stage->tick(rig.input).wrench_on_hand_W.t, rig.newest.wrench_on_hand_W.t);
}

TEST(Hold, ShowsTheServersWrenchUnchangedWhateverTheHandDoes) {
  StageRig rig;
  rig.newest.wrench_on_hand_W = {Vec3(1, 2, 3), Vec3(0.1, 0.2, 0.3)};
  const auto stage = make_stage({.name = "hold"});
  for (const double x : {0.0, 0.5, -3.0}) {
    rig.input.handle.X.p.x() = x;
    const Wrench on_hand = stage->tick(rig.input).wrench_on_hand_W;
    EXPECT_EQ(on_hand.f, rig.newest.wrench_on_hand_W.f);
    EXPECT_EQ(on_hand.t, rig.newest.wrench_on_hand_W.t);
  }
  rig.input.newest = nullptr;
  EXPECT_TRUE(stage->tick(rig.input).wrench_on_hand_W.f.isZero(0));
}

/// Supplies a server state in every fifth tick (200 Hz), with a force along x. Each state is `age` old on arrival. The
/// server's clock is one hour ahead.
struct LateForce {
  explicit LateForce(const char* name) : stage(make_stage({.name = name})) { rig.received.clock_offset = kOffset; }

  /// Runs one tick. Returns the displayed force.
  double tick(double (*force)(double t)) {
    now += std::chrono::milliseconds(1);
    rig.input.now = now;
    rig.input.is_new = ++k % 5 == 0;
    if (rig.input.is_new) {
      const LocalTime stepped = now - age;
      rig.newest.stepped = ServerTime(stepped.time_since_epoch() + kOffset);
      rig.received.received = now;
      rig.newest.wrench_on_hand_W.f.x() = force(to_seconds(stepped.time_since_epoch()));
    }
    rig.input.newest = k < 5 ? nullptr : &rig.received;
    return stage->tick(rig.input).wrench_on_hand_W.f.x();
  }

  static constexpr Duration kOffset{std::chrono::hours(1)};
  StageRig rig;
  std::unique_ptr<Stage> stage;
  LocalTime now{std::chrono::seconds(1)};
  Duration age{std::chrono::milliseconds(20)};
  int k = 0;
};

TEST(ForceStreamStage, LinearContinuesARampOverItsMeasuredAge) {
  LateForce late("linear");
  const auto ramp = [](double t) { return 2 * t; };
  for (int k = 0; k < 200; ++k) {
    const double shown = late.tick(ramp);
    if (k <= 100) continue;
    ASSERT_NEAR(shown, ramp(to_seconds(late.now.time_since_epoch())), 1e-6) << k;
  }
}

TEST(ForceStreamStage, ArFollowsASineBetterThanTheLastSample) {
  LateForce late("ar-spline"), held("hold");
  const auto sine = [](double t) { return 3 + std::sin(2 * 3.14159265358979 * 2 * t); };
  double late_error = 0, held_error = 0;
  for (int k = 0; k < 4000; ++k) {
    const double ar = late.tick(sine), hold = held.tick(sine);
    late.stage->service();
    if (k < 2000) continue;
    const double truth = sine(to_seconds(late.now.time_since_epoch()));
    late_error += std::pow(ar - truth, 2);
    held_error += std::pow(hold - truth, 2);
  }
  EXPECT_LT(std::sqrt(late_error), 0.25 * std::sqrt(held_error));
}

TEST(ForceStreamStage, FollowsTheNewestWrenchWhateverTheClockOffsetSaysAtFirst) {
  Random random(test::test_seed(59));
  for (const char* const name : {"linear", "ar", "ar-spline"}) {
    for (int trial = 0; trial < 100; ++trial) {
      LateForce late(name);
      // At first the clock offset is wrong by 1 ms to one year, as after an erroneous exchange of time stamps. Ten
      // states arrive before the offset is corrected. Fails if their wrong times make the stage ignore the later
      // states.
      const double off_s = std::exp(random.uniform(std::log(1e-3), std::log(3.15e7)));
      late.rig.received.clock_offset += from_seconds(random.uniform() < 0.5 ? off_s : -off_s);
      for (int k = 0; k < 50; ++k) late.tick([](double) { return 1.0; });
      late.rig.received.clock_offset = LateForce::kOffset;
      double shown = 0;
      for (int k = 0; k < 200; ++k) {
        shown = late.tick([](double) { return 3.0; });
        ASSERT_TRUE(std::isfinite(shown));
      }
      ASSERT_NEAR(shown, 3, 0.01) << name << ", off by " << off_s << " s";
    }
  }
}

TEST(ForceStreamStage, ForgetsOnReset) {
  LateForce late("linear");
  for (int k = 0; k < 50; ++k) late.tick([](double) { return 2.0; });
  late.stage->reset();
  late.rig.input.is_new = false;
  EXPECT_EQ(late.stage->tick(late.rig.input).wrench_on_hand_W.f.norm(), 0);
}

TEST(ForceStreamStage, SeesContactWithHysteresis) {
  const auto force = [](double f) { return Wrench{Vec3(f, 0, 0), Vec3::Zero()}; };
  EXPECT_FALSE(is_contact(force(0.07), false));
  EXPECT_TRUE(is_contact(force(0.2), false));
  EXPECT_TRUE(is_contact(force(0.07), true));
  EXPECT_FALSE(is_contact(force(0.01), true));
}

TEST(WaveStage, SendsItsModeToTheServerAndIsADamperUntilTheFirstEcho) {
  StageRig rig;
  const auto stage = make_stage({.name = "wave", .wave = {20, 0.01}});
  rig.input.tick.value = 1;
  stage->tick(rig.input);
  StageOutput output;
  for (int k = 0; k < 100; ++k) {
    ++rig.input.tick.value;
    rig.input.handle.X.p.x() += 1e-4;
    output = stage->tick(rig.input);
  }
  EXPECT_EQ(output.mode, proto::ClientMode::kWave);
  EXPECT_NEAR(output.wrench_on_hand_W.f.x(), -20 * 0.1, 1e-9) << "b v";
  EXPECT_GT(output.wave.f.x(), 0.9 * std::sqrt(2 * 20) * 0.01) << "√(2b) x";
}

TEST(WaveStage, AJumpOverTicksWithoutAHandIsNoVelocity) {
  StageRig rig;
  const auto stage = make_stage({.name = "wave", .wave = {20, 0.01}});
  rig.input.tick.value = 1;
  stage->tick(rig.input);
  rig.input.tick.value = 30;
  rig.input.handle.X.p.x() = 0.05;
  EXPECT_EQ(stage->tick(rig.input).wrench_on_hand_W.f.norm(), 0);
}

TEST(Stages, EveryListedNameMakesAStageOfThatName) {
  for (const std::string_view name : stage_names()) {
    for (const std::string_view predictor : predictor_names()) {
      const auto stage = make_stage({.name = std::string(name), .predictor = std::string(predictor)});
      ASSERT_NE(stage, nullptr);
      EXPECT_EQ(stage->name(), name);
    }
  }
  EXPECT_THAT(stage_names(),
              ::testing::IsSupersetOf({"late-pose", "hold", "linear", "ar", "ar-spline", "wave", "god-object"}));
  EXPECT_THAT(predictor_names(), ::testing::IsSupersetOf({"none", "hold", "linear", "ar-spline"}));
  EXPECT_EQ(make_stage({.name = "telepathy"}), nullptr);
  EXPECT_EQ(make_stage({.name = "hold", .predictor = "telepathy"}), nullptr);
}

TEST(Stages, WithoutAnyStateEachDisplaysNothing) {
  for (const std::string_view name : stage_names()) {
    StageRig rig;
    rig.input.newest = nullptr;
    rig.input.handle.X.p.x() = 0.01;
    const StageOutput output = make_stage({.name = std::string(name)})->tick(rig.input);
    EXPECT_TRUE(output.wrench_on_hand_W.f.isZero(0)) << name;
  }
}

}  // namespace
}  // namespace tandem::client

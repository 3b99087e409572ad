// The stages against closed form, and against Newton's third law.
#include "client/stage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "common/coupling/laws.hpp"
#include "common/random.hpp"

namespace tandem {
namespace {

CouplingParameters unlimited() {
  CouplingParameters parameters;
  parameters.stiffness_n_per_m = 500;
  parameters.damping_n_s_per_m = 2;
  parameters.stiffness_n_m_per_rad = 0.4;
  parameters.damping_n_m_s_per_rad = 0.01;
  parameters.force_limit_n = 1e3;
  parameters.torque_limit_n_m = 1e3;
  return parameters;
}

/// A stage input with its own coupling and server state.
struct Rig {
  Rig() {
    input.newest = &newest;
    input.coupling = &coupling;
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  SpringDamper coupling{unlimited()};
  ServerUpdate newest;
  StageInput input;
};

TEST(LatePose, IsASpringAndDamperBetweenHandleAndNewestTool) {
  Rig rig;
  rig.input.handle.X = {Vec3(0.01, 0, 0), quaternion_of(Vec3(0, 0, 0.2))};
  rig.input.handle.V = {Vec3(0, 0.1, 0), Vec3(0, 0, 1)};
  rig.newest.tool.V.v = Vec3(0, 0, 0.2);
  LatePose stage;
  const Wrench on_hand = stage.wrench_on_hand_W(rig.input);
  // The handle turns at 1 rad/s: its point at the tool, 0.01 m behind, moves at 0.1 − 0.01 m/s.
  EXPECT_LT((on_hand.f - Vec3(-5.0, -0.18, 0.4)).norm(), 1e-12) << "−(500 d + 2 Δv)";
  const Vec3 lever = Vec3(0.01, 0, 0).cross(-on_hand.f);
  EXPECT_LT((on_hand.t - lever - Vec3(0, 0, -(0.4 * 0.2 + 0.01 * 1))).norm(), 1e-12);
}

TEST(LatePose, PairOnHandAndToolSumsToZero) {
  const char* text = std::getenv("TANDEM_SEED");
  const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : 17;
  SCOPED_TRACE("TANDEM_SEED=" + std::to_string(seed));
  Random random(seed);
  const auto vector = [&random](double scale) {
    return Vec3(scale * Vec3(random.normal(), random.normal(), random.normal()));
  };
  Rig rig;
  LatePose stage;
  for (int i = 0; i < 1000; ++i) {
    rig.input.handle = {{vector(0.05), quaternion_of(vector(0.5))}, {vector(0.3), vector(3)}};
    rig.newest.tool = {{vector(0.05), quaternion_of(vector(0.5))}, {vector(0.3), vector(3)}};
    const Wrench on_hand = stage.wrench_on_hand_W(rig.input);
    const RigidState& tool = rig.newest.tool;
    const RigidState& handle = rig.input.handle;
    const Wrench on_tool = rig.coupling.wrench_on_tool_W(coupling_state(handle.X, handle.V, tool.X, tool.V));
    const Vec3 moment_about_T = on_tool.t + on_hand.t + (handle.X.p - tool.X.p).cross(on_hand.f);
    ASSERT_EQ(on_hand.f + on_tool.f, Vec3::Zero());
    ASSERT_LT(moment_about_T.norm(), 1e-12);
  }
}

TEST(LatePose, IsZeroAtTheToolAndWithoutAnyState) {
  Rig rig;
  rig.input.handle.X.p = rig.newest.tool.X.p = Vec3(1, 2, 3);
  LatePose stage;
  EXPECT_TRUE(stage.wrench_on_hand_W(rig.input).f.isZero(0));
  rig.input.newest = nullptr;
  rig.input.handle.X.p = Vec3::Zero();
  EXPECT_TRUE(stage.wrench_on_hand_W(rig.input).f.isZero(0));
}

TEST(LatePose, OfALawWithoutASpringShowsTheServersWrench) {
  Rig rig;
  const auto direct = make_coupling_law("direct", unlimited());
  rig.input.coupling = direct.get();
  rig.input.handle.X.p = Vec3(0.01, 0, 0);
  rig.newest.wrench_on_hand_W = {Vec3(1, 2, 3), Vec3(0.1, 0.2, 0.3)};
  LatePose stage;
  EXPECT_EQ(stage.wrench_on_hand_W(rig.input).f, rig.newest.wrench_on_hand_W.f);
  EXPECT_EQ(stage.wrench_on_hand_W(rig.input).t, rig.newest.wrench_on_hand_W.t);
}

TEST(Hold, ShowsTheServersWrenchUnchangedWhateverTheHandDoes) {
  Rig rig;
  rig.newest.wrench_on_hand_W = {Vec3(1, 2, 3), Vec3(0.1, 0.2, 0.3)};
  Hold stage;
  for (const double x : {0.0, 0.5, -3.0}) {
    rig.input.handle.X.p.x() = x;
    const Wrench on_hand = stage.wrench_on_hand_W(rig.input);
    EXPECT_EQ(on_hand.f, rig.newest.wrench_on_hand_W.f);
    EXPECT_EQ(on_hand.t, rig.newest.wrench_on_hand_W.t);
  }
  rig.input.newest = nullptr;
  EXPECT_TRUE(stage.wrench_on_hand_W(rig.input).f.isZero(0));
}

TEST(Stages, EveryListedNameMakesAStageOfThatName) {
  for (const std::string_view name : stage_names()) {
    const auto stage = make_stage(name);
    ASSERT_NE(stage, nullptr);
    EXPECT_EQ(stage->name(), name);
  }
  EXPECT_THAT(stage_names(), ::testing::IsSupersetOf({"late-pose", "hold"}));
  EXPECT_EQ(make_stage("telepathy"), nullptr);
}

}  // namespace
}  // namespace tandem

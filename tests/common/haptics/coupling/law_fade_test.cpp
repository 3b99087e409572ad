// Tests a change of the law while the coupling is stretched. The force must change from the old law's value to the new
// law's value without a step.
#include "common/haptics/coupling/law_fade.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "tests/support/allocation_counter.hpp"

namespace tandem::haptics {
namespace {

constexpr double kTick_s = 1e-3;
constexpr int kFadeTicks = 300;

const CouplingLawInfo& law(std::string_view name) {
  return *find_coupling_law(name);
}
CouplingState stretched() {
  CouplingState state;
  state.d_W = {0.012, -0.004, 0.006};
  state.theta_W = {0, 0.3, 0.1};
  state.v_W = {0.05, 0, -0.02};
  state.v_WH = {-0.05, 0, 0};
  return state;
}
void run(LawFade& fade, int ticks) {
  for (int i = 0; i < ticks; ++i) fade.advance(kTick_s);
}
std::vector<std::pair<const CouplingLawInfo*, const CouplingLawInfo*>> exchangeable_pairs() {
  std::vector<std::pair<const CouplingLawInfo*, const CouplingLawInfo*>> pairs;
  for (const CouplingLawInfo& from : coupling_laws()) {
    for (const CouplingLawInfo& to : coupling_laws()) {
      if (&from != &to && are_exchangeable(from, to)) pairs.emplace_back(&from, &to);
    }
  }
  return pairs;
}

TEST(LawFade, FadesFromTheForceOfOneLawToTheNextInEqualSteps) {
  const CouplingParameters soft{.stiffness_n_per_m = 250}, stiff{.stiffness_n_per_m = 700, .curve_sharpness = 2};
  ASSERT_EQ(exchangeable_pairs().size(), 20U);
  for (const auto& [from, to] : exchangeable_pairs()) {
    LawFade fade(*from, soft);
    const Wrench before = from->make(soft)->wrench_on_tool_W(stretched());
    const Wrench after = to->make(stiff)->wrench_on_tool_W(stretched());
    fade.fade_to(*to, stiff);
    EXPECT_EQ(fade.law().wrench_on_tool_W(stretched()).f, before.f) << from->name << " to " << to->name;
    for (int i = 1; i < kFadeTicks; ++i) {
      fade.advance(kTick_s);
      const double share = static_cast<double>(i) / kFadeTicks;
      const Wrench now = fade.law().wrench_on_tool_W(stretched());
      const Wrench expected = before * (1 - share) + after * share;
      ASSERT_LT((now.f - expected.f).norm(), 1e-9) << from->name << " to " << to->name << ", " << i << " ms";
      ASSERT_LT((now.t - expected.t).norm(), 1e-9) << from->name << " to " << to->name << ", " << i << " ms";
    }
    run(fade, 2);
    EXPECT_EQ(fade.law().wrench_on_tool_W(stretched()).f, after.f) << "to the last bit that of the law alone";
    EXPECT_EQ(fade.law().name(), to->name);
    EXPECT_EQ(fade.parameters(), stiff);
  }
}

TEST(LawFade, IsNeverSteeperThanTheSteeperOfBothLaws) {
  // The stiffness of each law is chosen such that its steepest slope is 1000 N/m, the bound.
  const CouplingParameters flat{.stiffness_n_per_m = 1000, .force_limit_n = 20},
      curved{.stiffness_n_per_m = 1000 / steepest_slope_factor("stable-dynamic", {.curve_sharpness = 10}),
             .force_limit_n = 20,
             .curve_sharpness = 10};
  for (const bool is_back : {false, true}) {
    LawFade fade(law(is_back ? "stable-dynamic" : "spring-damper"), is_back ? curved : flat);
    fade.fade_to(law(is_back ? "spring-damper" : "stable-dynamic"), is_back ? flat : curved);
    for (int i = 0; i < kFadeTicks + 2; ++i) {
      for (double d_m = 0; d_m < 0.04; d_m += 0.0005) {
        CouplingState state;
        state.d_W.x() = d_m;
        ASSERT_LE(fade.law().gradient(state).force_by_d(0, 0), 1000 * (1 + 1e-9)) << i << " ms, " << d_m;
      }
      fade.advance(kTick_s);
    }
  }
}

TEST(LawFade, HasTheGradientOfItsForce) {
  LawFade fade(law("stable-dynamic"), {});
  fade.fade_to(law("spring-damper"), {});
  run(fade, 100);
  constexpr double kSmall_m = 1e-7;
  CouplingState state, beside;
  state.d_W.x() = 0.008;
  beside.d_W.x() = state.d_W.x() + kSmall_m;
  const double slope =
      (fade.law().wrench_on_tool_W(beside).f.x() - fade.law().wrench_on_tool_W(state).f.x()) / kSmall_m;
  EXPECT_NEAR(fade.law().gradient(state).force_by_d(0, 0), slope, 1e-3);
}

TEST(LawFade, LetsTheNextChangeWaitForTheEndOfTheOneUnderWay) {
  LawFade fade(law("spring-damper"), {});
  fade.fade_to(law("qsa-dynamic"), {});
  run(fade, 100);
  fade.fade_to(law("stable-dynamic"), {.stiffness_n_per_m = 500});
  fade.fade_to(law("spring-damper"), {.stiffness_n_per_m = 400});
  double last_n = fade.law().wrench_on_tool_W(stretched()).f.norm();
  for (int i = 0; i < 2 * kFadeTicks; ++i) {
    fade.advance(kTick_s);
    const double now_n = fade.law().wrench_on_tool_W(stretched()).f.norm();
    ASSERT_LT(std::abs(now_n - last_n), 0.02) << i;
    last_n = now_n;
  }
  EXPECT_EQ(fade.law().name(), "spring-damper") << "the last requested law";
  const auto alone = law("spring-damper").make({.stiffness_n_per_m = 400});
  EXPECT_EQ(fade.law().wrench_on_tool_W(stretched()).f, alone->wrench_on_tool_W(stretched()).f);
}

TEST(LawFade, RampsCoefficientsThatChangeWhileALawFades) {
  LawFade fade(law("spring-damper"), {});
  fade.fade_to(law("qsa-dynamic"), {});
  run(fade, 200);
  fade.fade_to(law("qsa-dynamic"), {.stiffness_n_per_m = 600});
  double last_n = fade.law().wrench_on_tool_W(stretched()).f.norm(), largest_n = 0;
  for (int i = 0; i < kFadeTicks; ++i) {
    fade.advance(kTick_s);
    const double now_n = fade.law().wrench_on_tool_W(stretched()).f.norm();
    largest_n = std::max(largest_n, std::abs(now_n - last_n));
    last_n = now_n;
  }
  EXPECT_LT(largest_n, 0.05);
  EXPECT_EQ(fade.parameters().stiffness_n_per_m, 600);
}

TEST(CouplingRamp, ChangesTheForceSlowlyWhateverTheStiffnessAndTheDisplacement) {
  for (const double from : {1.0, 50.0, 300.0, 2000.0}) {
    for (const double to : {1.0, 50.0, 300.0, 2000.0, 20000.0}) {
      for (const double limit_n : {2.0, 6.5, 20.0}) {
        for (const double displacement_m : {1e-4, 1e-3, 0.01, 0.1, 1.0}) {
          CouplingRamp ramp({.stiffness_n_per_m = from, .force_limit_n = 6.5});
          ramp.fade_to({.stiffness_n_per_m = to, .force_limit_n = limit_n});
          const auto force_n = [&] {
            return std::min(ramp.now().force_limit_n, ramp.now().stiffness_n_per_m * displacement_m);
          };
          double before_n = force_n(), most_n = 0;
          int ticks = 0;
          while (ramp.advance(kTick_s)) {
            most_n = std::max(most_n, std::abs(force_n() - before_n));
            before_n = force_n();
            ++ticks;
          }
          EXPECT_LT(most_n, ticks >= 1000 ? 0.3 : 0.1)
              << from << " to " << to << " N/m, " << limit_n << " N, " << displacement_m << " m";
          const bool is_same = from == to && limit_n == 6.5;
          EXPECT_GE(ticks, is_same ? 0 : 100);
          EXPECT_LE(ticks, 1001);
          EXPECT_EQ(ramp.now().stiffness_n_per_m, to);
        }
      }
    }
  }
}

TEST(LawFade, LeavesALawWhoseToolIsAnother) {
  const CouplingParameters other{.stiffness_n_per_m = 700};
  for (const auto& [from, to] : {std::pair{"spring-damper", "qsa-static"}, std::pair{"qsa-static", "spring-damper"},
                                 std::pair{"spring-damper", "direct"}, std::pair{"direct", "qsa-static"}}) {
    LawFade fade(law(from), {});
    fade.fade_to(law(to), other);
    run(fade, kFadeTicks + 2);
    EXPECT_EQ(fade.law().name(), from);
    EXPECT_EQ(fade.parameters(), CouplingParameters{}) << from << " to " << to;
  }
}

TEST(LawFade, AllocatesNothing) {
  LawFade fade(law("spring-damper"), {});
  const std::uint64_t before = test::allocation_count();
  fade.fade_to(law("stable-dynamic-literal"), {.stiffness_n_per_m = 500});
  for (int i = 0; i < 400; ++i) {
    fade.advance(kTick_s);
    fade.law().wrench_on_tool_W(stretched());
    fade.law().gradient(stretched());
  }
  fade.jump_to(law("direct"), {});
  EXPECT_EQ(test::allocation_count() - before, 0U);
}

TEST(LawChange, IsToAPassiveLawOfAToolWithMassElseRefusedWithAReason) {
  for (const CouplingLawInfo& of_scene : coupling_laws()) {
    EXPECT_EQ(law_change_problem(of_scene, of_scene, false), "")
        << of_scene.name << ": the current law of the scene must be allowed";
    for (const CouplingLawInfo& wanted : coupling_laws()) {
      if (&wanted == &of_scene) continue;
      const bool needs_fit = wanted.name == kAdaptiveLaw;
      const bool have_mass = of_scene.tool == ToolDynamics::kWithMass && wanted.tool == ToolDynamics::kWithMass;
      const bool is_safe = have_mass && wanted.is_passive;
      EXPECT_EQ(law_change_problem(of_scene, wanted, true).empty(), is_safe) << of_scene.name << ", " << wanted.name;
      EXPECT_EQ(law_change_problem(of_scene, wanted, false).empty(), is_safe && !needs_fit);
    }
  }
  EXPECT_NE(law_change_problem(law("spring-damper"), law("qsa-static"), false).find("no mass"), std::string::npos);
  EXPECT_NE(law_change_problem(law("spring-damper"), law("qsa-dynamic"), false).find("energy"), std::string::npos);
  EXPECT_NE(law_change_problem(law("direct"), law("spring-damper"), false).find("direct"), std::string::npos);
}

}  // namespace
}  // namespace tandem::haptics

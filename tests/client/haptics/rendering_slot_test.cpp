// Tests the replacement of a rendering on the haptic thread: a new rendering is offered and adopted, and its force is
// blended with that of the old rendering.
#include "client/haptics/rendering_slot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/model/local_model.hpp"
#include "client/model/proxy_world.hpp"

namespace tandem::client {
namespace {

/// A stage with a constant force.
class ConstantStage final : public Stage {
 public:
  explicit ConstantStage(double force_n) : force_n_(force_n) {}
  std::string_view name() const noexcept override { return "constant"; }
  StageOutput tick(const StageInput&) noexcept override {
    StageOutput output;
    output.wrench_on_hand_W.f.x() = force_n_;
    return output;
  }

 private:
  double force_n_;
};

std::unique_ptr<Rendering> rendering_of(double force_n, std::uint32_t generation = 0) {
  auto rendering = std::make_unique<Rendering>();
  rendering->stage = std::make_unique<ConstantStage>(force_n);
  rendering->generation = generation;
  return rendering;
}

double force_n(RenderingSlot& slot) {
  return slot.tick({}).wrench_on_hand_W.f.x();
}

TEST(RenderingSlot, UsesTheFirstUntilAnotherIsEntered) {
  RenderingSlot slot(std::make_unique<ConstantStage>(1));
  EXPECT_EQ(slot.offered(), 1U);
  EXPECT_FALSE(slot.enter(slot.newest(), nullptr));
  auto second = rendering_of(2);
  ASSERT_TRUE(slot.offer(second));
  EXPECT_EQ(slot.offered(), 2U);
  EXPECT_EQ(force_n(slot), 1);
  EXPECT_TRUE(slot.enter(slot.newest(), nullptr));
  EXPECT_FALSE(slot.enter(slot.newest(), nullptr));
  EXPECT_EQ(slot.shown_locally(), 0U) << "neither has a local model";
}

TEST(RenderingSlot, RefusesAnOfferWhileAnOlderOneIsNotEntered) {
  RenderingSlot slot(std::make_unique<ConstantStage>(1));
  auto second = rendering_of(2), third = rendering_of(3);
  ASSERT_TRUE(slot.offer(second));
  EXPECT_FALSE(slot.offer(third));
  EXPECT_NE(third, nullptr);
  slot.enter(slot.newest(), nullptr);
  EXPECT_TRUE(slot.offer(third));
}

TEST(RenderingSlot, BlendsFromOneForceToTheNext) {
  RenderingSlot slot(std::make_unique<ConstantStage>(1));
  double before_n = force_n(slot);
  auto second = rendering_of(10);
  ASSERT_TRUE(slot.offer(second));
  slot.enter(slot.newest(), nullptr);
  double steepest_n = 0;
  for (int i = 0; i < 1000; ++i) {
    const double now_n = force_n(slot);
    steepest_n = std::max(steepest_n, std::abs(now_n - before_n));
    before_n = now_n;
  }
  EXPECT_LT(steepest_n, 0.05) << "a difference of 9 N changes by less than 0.05 N in a tick";
  EXPECT_NEAR(before_n, 10, 0.01);
}

TEST(RenderingSlot, ShowsItsModelsOnlyToTheirScene) {
  RenderingSlot slot(std::make_unique<ConstantStage>(1));
  auto second = rendering_of(2, 7);
  ASSERT_TRUE(slot.offer(second));
  slot.enter(slot.newest(), nullptr);
  EXPECT_EQ(slot.of_scene(6), nullptr);
  EXPECT_NE(slot.of_scene(7), nullptr);
}

}  // namespace
}  // namespace tandem::client

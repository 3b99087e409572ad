// Sleeping bodies must take no time, and must respond like bodies that are awake.
#include "common/physics/untouched_bodies.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/common/physics/scene_support.hpp"

namespace tandem::physics {
namespace {

constexpr double kUntouchedStep_s = 1e-3;
constexpr double kEdge_m = 0.04;

/// A table with two stacked cubes of 0.2 kg each, and another cube 10 mm beside them.
class Stack : public testing::Test {
 protected:
  static constexpr std::size_t kLower = 1, kUpper = 2, kBeside = 3;

  Stack() {
    for (const BodyDescription& body : scene_->world.bodies) {
      bodies_.emplace_back(body.mass, body.traits, 1, body.X_WB);
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) free_->add(i, bodies_[i]);
  }

  static std::string cube(const std::string& name, double y_m, double z_m) {
    return R"(, {"name": ")" + name +
           R"(", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}], "mass_kg": 0.2, "graspable": true,
                 "placement": {"position_m": [0, )" +
           std::to_string(y_m) + ", " + std::to_string(z_m) + "]}}";
  }
  void run(double seconds) {
    for (double time_s = 0; time_s < seconds; time_s += kUntouchedStep_s) free_->step(kUntouchedStep_s);
  }
  bool rests(std::size_t body) const {
    const Twist& V = bodies_[body].velocity_of_centre_W();
    return V.v.isZero(0) && V.w.isZero(0);
  }
  double height_m(std::size_t body) const { return bodies_[body].centre_W().z(); }

  std::shared_ptr<const server::LoadedScene> scene_ = load_parts(
      {.bodies =
           R"({"name": "table", "shapes": [{"box": {"size_m": [2, 2, 0.1]}}], "placement": {"position_m": [0, 0, -0.05]}})" +
           cube("lower", 0, kEdge_m / 2) + cube("upper", 0, 1.5 * kEdge_m) + cube("beside", -0.05, kEdge_m / 2)});
  std::vector<RigidBody> bodies_;
  std::unique_ptr<FreeBodies> free_ = make_untouched_bodies(scene_->world);
};

TEST_F(Stack, RestsWithoutAnyMotion) {
  run(4);
  EXPECT_TRUE(rests(kLower));
  EXPECT_TRUE(rests(kUpper));
  const Vec3 place = bodies_[kUpper].centre_W();
  run(4);
  EXPECT_EQ(bodies_[kUpper].centre_W(), place);
  EXPECT_NEAR(height_m(kUpper), 1.5 * kEdge_m, 1e-4);
}

TEST_F(Stack, AnswersAForceInTheSameStep) {
  run(4);
  // The force is twice the friction limit, so the body must move in this step.
  bodies_[kUpper].apply_wrench({{0, 2, 0}, Vec3::Zero()}, bodies_[kUpper].centre_W());
  run(kUntouchedStep_s / 2);
  const double pushed_m_per_s = 2 / 0.2 * kUntouchedStep_s, braked_m_per_s = 0.5 * 9.81 * kUntouchedStep_s;
  EXPECT_NEAR(bodies_[kUpper].velocity_of_centre_W().v.y(), pushed_m_per_s - braked_m_per_s, 0.1 * pushed_m_per_s);
}

TEST_F(Stack, AnswersAVelocityInTheSameStep) {
  run(4);
  bodies_[kUpper].set_centre(bodies_[kUpper].centre_pose(), {{0, 0, 1}, Vec3::Zero()});
  run(kUntouchedStep_s / 2);
  EXPECT_NEAR(height_m(kUpper), 1.5 * kEdge_m + kUntouchedStep_s, 1e-4);
}

TEST_F(Stack, FallsWhenItsSupportIsGrabbed) {
  run(4);
  free_->remove(kLower);
  run(0.05);
  EXPECT_NEAR(height_m(kUpper), 1.5 * kEdge_m - 9.81 * 0.05 * 0.05 / 2, 1e-3);
}

TEST_F(Stack, FallsWhenItsSupportIsPlacedElsewhere) {
  run(4);
  bodies_[kLower].set_centre({{0.5, 0, kEdge_m / 2}, Quat::Identity()}, {});
  run(0.05);
  EXPECT_NEAR(height_m(kUpper), 1.5 * kEdge_m - 9.81 * 0.05 * 0.05 / 2, 1e-3);
}

TEST_F(Stack, DoesNotWakeABodyBesideIt) {
  run(4);
  free_->remove(kUpper);
  run(1);
  EXPECT_TRUE(rests(kBeside)) << bodies_[kBeside].velocity_of_centre_W().v.norm();
  free_->add(kUpper, bodies_[kUpper]);
  run(0.02);
  EXPECT_TRUE(rests(kBeside)) << bodies_[kBeside].velocity_of_centre_W().v.norm();
  EXPECT_FALSE(rests(kUpper));
}

TEST_F(Stack, WakesABodyThatIsHit) {
  run(4);
  bodies_[kLower].set_centre({{0.2, 0, kEdge_m / 2}, Quat::Identity()}, {});
  run(4);
  ASSERT_TRUE(rests(kLower) && rests(kUpper));
  bodies_[kLower].set_centre(bodies_[kLower].centre_pose(), {{-2, 0, 0}, Vec3::Zero()});
  // Momentum of both cubes. During the test, they lose about a tenth of it to the table by friction, and some more by
  // the pressure of the tilting cubes.
  const auto momentum = [&] {
    return bodies_[kLower].velocity_of_centre_W().v.x() + bodies_[kUpper].velocity_of_centre_W().v.x();
  };
  double before = 0;
  while (rests(kUpper)) {
    before = momentum();
    run(kUntouchedStep_s / 2);
  }
  run(0.015);
  EXPECT_LT(momentum(), 0.75 * before);
  run(0.2);
  EXPECT_LT(bodies_[kUpper].centre_W().x(), -0.05);
}

}  // namespace
}  // namespace tandem::physics

// Tests the clutch under random motion: position and rotation of the handle must not jump when it is pressed or
// released.
#include "client/haptics/clutch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "common/base/random.hpp"

namespace tandem::client {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kRounding = 1e-12;

double rotation_between(const Quat& a, const Quat& b) {
  return rotation_vector(a * b.conjugate()).norm();
}

/// A simulated hand that moves with bounded random velocity.
class RandomHand {
 public:
  explicit RandomHand(std::uint64_t seed) : random_(seed) {}

  RigidState next() {
    state_.V.v += 0.02 * vector();
    state_.V.w += 0.1 * vector();
    state_.V.v = clamped_to_length(state_.V.v, 1.0);
    state_.V.w = clamped_to_length(state_.V.w, 10.0);
    state_.X = integrate(state_.X, state_.V, kTick_s);
    if (random_.uniform() < 0.01) is_pressed_ = !is_pressed_;
    return state_;
  }
  bool is_pressed() const { return is_pressed_; }

 private:
  Vec3 vector() { return {random_.normal(), random_.normal(), random_.normal()}; }

  Random random_;
  RigidState state_;
  bool is_pressed_ = false;
};

TEST(Clutch, HandleNeverMovesMoreThanTheHandDidWhateverTheButtonDoes) {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : 99;
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  RandomHand hand(seed);
  Clutch clutch;
  RigidState raw = hand.next();
  RigidState out = clutch.apply(raw, hand.is_pressed());
  int edges = 0;
  bool was_pressed = hand.is_pressed();
  for (int i = 0; i < 50000; ++i) {
    const RigidState raw_before = raw;
    const RigidState out_before = out;
    raw = hand.next();
    out = clutch.apply(raw, hand.is_pressed());
    ASSERT_LE((out.X.p - out_before.X.p).norm(), (raw.X.p - raw_before.X.p).norm() + kRounding) << "tick " << i;
    ASSERT_LE(rotation_between(out.X.q, out_before.X.q), rotation_between(raw.X.q, raw_before.X.q) + 1e-7)
        << "tick " << i;
    if (hand.is_pressed()) {
      ASSERT_TRUE(out.V.v.isZero(0) && out.V.w.isZero(0));
      ASSERT_TRUE(!was_pressed || out.X.p == out_before.X.p) << "frozen";
    }
    edges += hand.is_pressed() != was_pressed ? 1 : 0;
    was_pressed = hand.is_pressed();
  }
  EXPECT_GT(edges, 100);
}

TEST(Clutch, ReleaseTickShowsExactlyTheFrozenPose) {
  Clutch clutch;
  RigidState raw;
  raw.X = {Vec3(0.1, 0.2, 0.3), quaternion_of(Vec3(0.3, -0.2, 0.1))};
  const Pose frozen = clutch.apply(raw, true).X;
  raw.X = {Vec3(-0.4, 0, 0.1), quaternion_of(Vec3(-1.0, 0.5, 2.0))};
  const Pose released = clutch.apply(raw, false).X;
  EXPECT_LT((released.p - frozen.p).norm(), kRounding);
  EXPECT_LT(rotation_between(released.q, frozen.q), 1e-12);
}

TEST(Clutch, AfterReleaseTheToolTurnsAboutTheWorldAxisTheHandTurnsAbout) {
  Clutch clutch;
  RigidState raw;
  clutch.apply(raw, true);
  raw.X.q = quaternion_of(Vec3(0.7, -0.4, 1.1));
  const Quat before = clutch.apply(raw, false).X.q;
  const Vec3 turn(0, 0, 0.3);
  raw.X.q = quaternion_of(turn) * raw.X.q;
  raw.V.w = Vec3(0, 0, 2);
  const RigidState after = clutch.apply(raw, false);
  EXPECT_LT((rotation_vector(after.X.q * before.conjugate()) - turn).norm(), 1e-12);
  EXPECT_EQ(after.V.w, raw.V.w) << "so the reported turn rate is the pose's";
}

TEST(Clutch, WithoutTheButtonTheHandleIsTheHand) {
  Clutch clutch;
  RigidState raw;
  raw.X = {Vec3(1, 2, 3), quaternion_of(Vec3(0.1, 0.2, 0.3))};
  raw.V = {Vec3(0.1, 0, 0), Vec3(0, 1, 0)};
  const RigidState out = clutch.apply(raw, false);
  EXPECT_EQ(out.X.p, raw.X.p);
  EXPECT_LT(rotation_between(out.X.q, raw.X.q), 1e-12);
  EXPECT_EQ(out.V.v, raw.V.v);
}

TEST(Clutch, ResetForgetsTheOffset) {
  Clutch clutch;
  RigidState raw;
  clutch.apply(raw, true);
  raw.X.p = Vec3(1, 0, 0);
  EXPECT_EQ(clutch.apply(raw, false).X.p, Vec3::Zero());
  clutch.reset();
  EXPECT_EQ(clutch.apply(raw, false).X.p, raw.X.p);
}

}  // namespace
}  // namespace tandem::client

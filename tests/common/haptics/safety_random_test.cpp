// Tests the guarantees of the safety chain with random input. A failure prints the seed; TANDEM_TEST_SEED repeats it.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>

#include "common/base/random.hpp"
#include "common/haptics/safety.hpp"

namespace tandem::haptics {
namespace {

constexpr Duration kTick{std::chrono::milliseconds(1)};
// Bound of the rounding error of a few operations on numbers of the order of 10.
constexpr double kRounding = 1e-12;

std::uint64_t test_seed() {
  const char* text = std::getenv("TANDEM_TEST_SEED");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 20240517;
}

/// Random input of any kind: NaN, infinite and very large components, periods without states, lost samples, extreme
/// speeds.
class RandomInput {
 public:
  explicit RandomInput(std::uint64_t seed) : random_(seed) {}

  SafetyInput next() {
    if (random_.uniform() < 0.02) base_ = Vec3(component(), component(), component());
    SafetyInput input;
    input.wrench.f = base_;
    input.wrench.t = 0.1 * base_;
    if (random_.uniform() < 0.005) silent_ticks_ = 1 + random_.next_u32() % 300;
    age_ = silent_ticks_ > 0 ? age_ + kTick : Duration{0};
    if (silent_ticks_ > 0) --silent_ticks_;
    input.state_age = age_;
    input.has_state = random_.uniform() > 0.0005;
    input.is_displaying = random_.uniform() > 0.0005;
    input.sample_is_valid = random_.uniform() > 0.002;
    input.is_clutched = random_.uniform() < 0.001;
    input.handle_speed_m_per_s = random_.uniform() < 0.002 ? 10 : 0.1;
    return input;
  }
  Duration gap() { return random_.uniform() < 0.01 ? kTick * (random_.next_u32() % 60) : kTick; }
  bool flips(double probability) { return random_.uniform() < probability; }

 private:
  double component() {
    const double kind = random_.uniform();
    if (kind < 0.01) return std::numeric_limits<double>::quiet_NaN();
    if (kind < 0.02) return -std::numeric_limits<double>::infinity();
    if (kind < 0.03) return 1.7e308;
    return random_.uniform(-8, 8);
  }

  Random random_;
  Vec3 base_ = Vec3::Zero();
  Duration age_{0};
  unsigned silent_ticks_ = 0;
};

TEST(Safety, AnyInputGivesFiniteOutputWithinTheSlewLimitExceptWhileDecaying) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("TANDEM_TEST_SEED=" + std::to_string(seed));
  RandomInput inputs(seed);
  SafetyChain chain{SafetySettings{}};
  LocalTime now{};
  Wrench before;
  std::size_t displayed_ticks = 0;
  Duration since_rearm{std::chrono::seconds(1)};
  for (int i = 0; i < 200000; ++i) {
    const Duration gap = inputs.gap();
    now += gap;
    since_rearm += gap;
    if (inputs.flips(0.0005)) {
      chain.rearm();
      since_rearm = Duration{0};
    }
    const SafetyFaults faults_before = chain.faults();
    const SafetyInput input = inputs.next();
    const Wrench out = chain.apply(now, input);
    ASSERT_TRUE(is_finite(out)) << "tick " << i;
    const double dt_s = to_seconds(gap);
    // Ticks may be 60 ms apart. The last tick of a decay, which takes 20 ms, may therefore be up to 80 ms after its
    // start.
    const bool is_decaying = ((chain.faults() | faults_before) & ~(kSafetyRamping | kSafetySlewed)) != 0 ||
                             since_rearm <= std::chrono::milliseconds(80);
    if (!is_decaying) {
      ASSERT_LE((out.f - before.f).norm(), 4000 * dt_s + kRounding) << "tick " << i;
      ASSERT_LE((out.t - before.t).norm(), 200 * dt_s + kRounding) << "tick " << i;
    }
    ASSERT_LE(out.f.norm() - before.f.norm(), 4000 * dt_s + kRounding) << "it never grows faster, tick " << i;
    if (input.state_age >= std::chrono::milliseconds(148)) {
      ASSERT_TRUE(out.f.isZero(0) && out.t.isZero(0)) << "tick " << i;
    }
    displayed_ticks += out.f.norm() > 0.1 ? 1 : 0;
    before = out;
  }
  EXPECT_GT(displayed_ticks, 20000U) << "too few ticks displayed a force, so the test shows little";
}

}  // namespace
}  // namespace tandem::haptics

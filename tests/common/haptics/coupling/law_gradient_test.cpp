// Compares the gradients of all laws with finite differences of their wrenches, in all sections of the curves.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "tests/common/haptics/coupling/coupling_draws.hpp"
#include "tests/common/haptics/coupling/law_instances.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::haptics {
namespace {

/// Either the translation or the rotation of a coupling law: members for its inputs and its output, with their scales.
struct Channel {
  Vec3 CouplingState::*displacement;
  Vec3 CouplingState::*velocity;
  Vec3 CouplingState::*handle_velocity;
  Vec3 Wrench::*force;
  double stiffness;
  double damping;
  double limit;

  double bend_displacement() const { return limit / stiffness; }
};

std::array<Channel, 2> channels_of(const CouplingParameters& c) {
  return {Channel{&CouplingState::d_W, &CouplingState::v_W, &CouplingState::v_WH, &Wrench::f, c.stiffness_n_per_m,
                  c.damping_n_s_per_m, c.force_limit_n},
          Channel{&CouplingState::theta_W, &CouplingState::w_W, &CouplingState::w_WH, &Wrench::t,
                  c.stiffness_n_m_per_rad, c.damping_n_m_s_per_rad, c.torque_limit_n_m}};
}

Eigen::Matrix3d finite_differences(const CouplingLaw& law, const CouplingState& state, Vec3 CouplingState::*by,
                                   Vec3 Wrench::*of, double step) {
  Eigen::Matrix3d slope;
  for (int k = 0; k < 3; ++k) {
    CouplingState more = state, less = state;
    (more.*by)[k] += step;
    (less.*by)[k] -= step;
    slope.col(k) = (law.wrench_on_tool_W(more).*of - law.wrench_on_tool_W(less).*of) / ((more.*by)[k] - (less.*by)[k]);
  }
  return slope;
}

/// Compares trace, trace of the square, and determinant. If these are equal, the two matrices have equal eigenvalues.
void expect_same_eigenvalues(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, double tolerance, double scale) {
  EXPECT_NEAR(a.trace(), b.trace(), tolerance * scale);
  EXPECT_NEAR((a * a).trace(), (b * b).trace(), tolerance * scale * scale);
  EXPECT_NEAR(a.determinant(), b.determinant(), tolerance * scale * scale * scale);
}

void expect_symmetric_and_not_negative(const Eigen::Matrix3d& given, double scale) {
  EXPECT_LT((given - given.transpose()).norm(), 1e-14 * scale);
  EXPECT_GT(given.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-14 * scale);
}

class EveryLawsGradient : public testing::TestWithParam<CouplingLawInfo> {
 protected:
  struct Regimes {
    int below_knee = 0;
    int above_knee = 0;
    int pushing = 0;
    int receding = 0;
  };

  CouplingState draw(const Channel& channel) {
    CouplingState state;
    state.*channel.displacement =
        random_magnitude(random_, 1e-3, 30) * channel.bend_displacement() * random_vector(random_, 1).normalized();
    state.*channel.velocity =
        random_magnitude(random_, 1e-3, 10) * channel.limit / channel.damping * random_vector(random_, 1).normalized();
    // In half of the draws, displacement and velocity have the same direction, as when a hand presses without sliding.
    is_along_ = random_.uniform() < 0.5;
    if (is_along_) {
      const Vec3 direction = (state.*channel.displacement).normalized();
      state.*channel.velocity = (state.*channel.velocity).norm() * direction;
    }
    state.*channel.handle_velocity = random_vector(random_, 1);
    return state;
  }

  /// Returns true if finite differences are not valid: close to the knee of the saturation, and close to a reversal of
  /// the hand's motion.
  static bool is_at_a_switch(const CouplingLaw& law, const CouplingParameters& c, const Channel& channel,
                             const CouplingState& state) {
    const double knee = (1 - c.saturation_softness) * channel.limit;
    const double force = (law.wrench_on_tool_W(state).*channel.force).norm();
    const double advance = (state.*channel.displacement).dot((state.*channel.handle_velocity).normalized());
    return std::abs(force - knee) < 1e-4 * channel.limit || std::abs(advance) < 1e-4 * channel.bend_displacement();
  }

  void compare(const CouplingLaw& law, const CouplingParameters& c, const Channel& channel, const CouplingState& state,
               const Eigen::Matrix3d& by_displacement, const Eigen::Matrix3d& by_velocity) {
    constexpr double kRelativeStep = 1e-5;
    // A central difference has a relative error of (a/b)², with its step a and the shortest length b over which the
    // force bends. b is the softness (5 % of the limit) or the displacement itself (1e-3 of the bend displacement).
    constexpr double kTolerance = 1e-5;
    const double steepest = channel.stiffness * std::max(1.0, std::sqrt(c.curve_sharpness));
    const Eigen::Matrix3d slope = finite_differences(law, state, channel.displacement, channel.force,
                                                     kRelativeStep * channel.bend_displacement());
    const bool is_below_knee =
        (law.wrench_on_tool_W(state).*channel.force).norm() < (1 - c.saturation_softness) * channel.limit;
    if (is_below_knee || is_along_) {
      EXPECT_LT((by_displacement - slope).norm(), kTolerance * steepest);
    }
    expect_same_eigenvalues(by_displacement, slope, 10 * kTolerance, steepest);
    expect_symmetric_and_not_negative(by_displacement, steepest);

    const Eigen::Matrix3d slope_by_velocity = finite_differences(law, state, channel.velocity, channel.force,
                                                                 kRelativeStep * channel.limit / channel.damping);
    EXPECT_LT((by_velocity - slope_by_velocity).norm(), kTolerance * channel.damping);
    expect_symmetric_and_not_negative(by_velocity, channel.damping);
    count(is_below_knee, (state.*channel.displacement).dot(state.*channel.handle_velocity) >= 0);
  }

  void count(bool is_below_knee, bool is_pushing) {
    ++(is_below_knee ? regimes_.below_knee : regimes_.above_knee);
    ++(is_pushing ? regimes_.pushing : regimes_.receding);
  }

  std::uint64_t seed_ = test::test_seed(71);
  Random random_{seed_};
  bool is_along_ = false;
  Regimes regimes_;
};

TEST_P(EveryLawsGradient, IsThatOfTheWrenchSymmetricAndNotNegative) {
  for (int i = 0; i < 1000 && !HasFailure(); ++i) {
    const CouplingParameters c = random_parameters(random_);
    const auto law = GetParam().make(c);
    const Channel channel = channels_of(c).at(static_cast<std::size_t>(i % 2));
    const CouplingState state = draw(channel);
    if (is_at_a_switch(*law, c, channel, state)) continue;
    const CouplingGradient g = law->gradient(state);
    SCOPED_TRACE("seed " + std::to_string(seed_) + " draw " + std::to_string(i));
    if (i % 2 == 0) {
      compare(*law, c, channel, state, g.force_by_d, g.force_by_v);
    } else {
      compare(*law, c, channel, state, g.torque_by_theta, g.torque_by_w);
    }
  }
  EXPECT_GT(regimes_.pushing, 300);
  EXPECT_GT(regimes_.receding, 300);
  if (GetParam().tool == ToolDynamics::kAtHandle) return;
  EXPECT_GT(regimes_.below_knee, 200);
  EXPECT_GT(regimes_.above_knee, 200);
}

TEST_P(EveryLawsGradient, IsZeroForInputThatIsNotFinite) {
  const auto law = GetParam().make({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const CouplingGradient g = law->gradient({.d_W = {nan, 0, 0}, .w_W = {0, nan, 0}});
  EXPECT_EQ(g.force_by_d, Eigen::Matrix3d::Zero());
  EXPECT_EQ(g.force_by_v, Eigen::Matrix3d::Zero());
  EXPECT_EQ(g.torque_by_theta, Eigen::Matrix3d::Zero());
  EXPECT_EQ(g.torque_by_w, Eigen::Matrix3d::Zero());
}

INSTANTIATE_TEST_SUITE_P(Catalog, EveryLawsGradient, testing::ValuesIn(coupling_laws()), law_test_name);

}  // namespace
}  // namespace tandem::haptics

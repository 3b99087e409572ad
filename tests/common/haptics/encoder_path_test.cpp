// Tests the work along the encoder path, for a hand on a spring. It must equal the work along the true path: encoder
// steps must not appear as work.
#include "common/haptics/encoder_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/base/spatial.hpp"

namespace tandem::haptics {
namespace {

constexpr double kPeriod = 0.001;
constexpr double kStep_m = 6e-5;
constexpr double kStep_rad = 1e-3;

double stepped(double value, double step) {
  return step * std::round(value / step);
}

/// Errors for a handle that moves ± 20 mm at 1 Hz on a spring of 500 N/m. The force is computed from the reported
/// position.
struct Swing {
  double path_error_j = 0;  ///< largest error of the work, |Σ F·Δp − Σ F·Δx|; p: position on the path, x: true position
  double report_error_j = 0;  ///< same error for the reported position, which replaces p
  double farthest_m = 0;      ///< largest distance of the path from the true position
};

Swing swing() {
  constexpr double kStiffness = 500, kSwing_m = 0.02, kOmega = 2 * std::numbers::pi;
  Swing result;
  EncoderPath path(kStep_m, kStep_rad);
  double force_n = 0, true_j = 0, path_j = 0, report_j = 0;
  Vec3 before = Vec3::Zero();  // components: x true position, y position on the path, z reported position
  for (int k = 0; k < 10000; ++k) {
    const double t = k * kPeriod;
    const double x = kSwing_m * std::sin(kOmega * t), v = kSwing_m * kOmega * std::cos(kOmega * t);
    const Pose report{Vec3(stepped(x, kStep_m), 0, 0), Quat::Identity()};
    const Vec3 now(x, path.follow(report, {Vec3(v, 0, 0), Vec3::Zero()}, kPeriod).p.x(), report.p.x());
    const Vec3 work = force_n * (now - before);
    true_j += work.x();
    path_j += work.y();
    report_j += work.z();
    before = now;
    force_n = -kStiffness * report.p.x();
    result.path_error_j = std::max(result.path_error_j, std::abs(path_j - true_j));
    result.report_error_j = std::max(result.report_error_j, std::abs(report_j - true_j));
    result.farthest_m = std::max(result.farthest_m, std::abs(now.y() - x));
  }
  return result;
}

TEST(EncoderPath, OfASwingOnASpringHasTheWorkOfTheHandAndIsWithinAStep) {
  const Swing measured = swing();
  EXPECT_LE(measured.farthest_m, kStep_m);
  EXPECT_LT(measured.path_error_j, 0.3 * measured.report_error_j) << measured.report_error_j;
}

TEST(EncoderPath, DoesNotMoveForAReportThatAlternatesBetweenTwoSteps) {
  EncoderPath path(kStep_m, kStep_rad);
  path.follow({Vec3(kStep_m, 0, 0), Quat::Identity()}, {}, kPeriod);
  const Pose first = path.follow({Vec3::Zero(), Quat::Identity()}, {}, kPeriod);
  for (int k = 0; k < 100; ++k) {
    const Pose hops = path.follow({Vec3(k % 2 == 0 ? kStep_m : 0, 0, 0), Quat::Identity()}, {}, kPeriod);
    ASSERT_NEAR((hops.p - first.p).norm(), 0, 1e-12) << k;
  }
}

TEST(EncoderPath, TurnsNoFartherFromTheReportThanHalfAStep) {
  EncoderPath path(kStep_m, kStep_rad);
  const double reach_rad = kStep_rad / 2;
  for (int k = 0; k < 2000; ++k) {
    const double angle = 3e-5 * k;
    const Pose report{Vec3::Zero(), quaternion_of(Vec3(0, 0, stepped(angle, kStep_rad)))};
    const Pose at = path.follow(report, {Vec3::Zero(), Vec3(0, 0, 0.03)}, kPeriod);
    const Vec3 off = rotation_vector(at.q * report.q.conjugate());
    ASSERT_LE(off.norm(), reach_rad + 1e-12);
    ASSERT_NEAR(rotation_vector(at.q).z(), angle, kStep_rad) << "and follows the handle";
  }
}

TEST(EncoderPath, WithoutStepsIsTheReport) {
  EncoderPath path(0, 0);
  path.follow({}, {}, kPeriod);
  const Pose report{Vec3(0.01, 0.02, 0.03), quaternion_of(Vec3(0.1, 0, 0))};
  const Pose at = path.follow(report, {Vec3(1, 0, 0), Vec3(1, 0, 0)}, kPeriod);
  EXPECT_EQ(at.p, report.p);
  EXPECT_EQ(at.q.coeffs(), report.q.coeffs());
}

TEST(EncoderPath, BeginsAnewAfterTheHandleWasLost) {
  EncoderPath path(kStep_m, kStep_rad);
  path.follow({}, {}, kPeriod);
  path.lose_pose();
  const Pose there{Vec3(0.1, 0, 0), Quat::Identity()};
  EXPECT_EQ(path.follow(there, {}, kPeriod).p, there.p);
}

}  // namespace
}  // namespace tandem::haptics

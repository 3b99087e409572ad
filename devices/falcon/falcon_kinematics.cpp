#include "devices/falcon/falcon_kinematics.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

namespace tandem::devices {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
// Lengths of the links [m]: thigh, shin, and the joint offsets at the parallelogram and the grip.
constexpr double kThigh = 0.060, kShin = 0.1025, kC = 0.01443, kD = 0.01125, kE = 0.01125, kF = -0.025;
constexpr double kMotorRadius = 0.0400, kMotorOffset = -0.02309;
constexpr std::array<double, 3> kLegs_rad{105 * kDegree, -15 * kDegree, -135 * kDegree};
constexpr double kCountsATurn = 320 * 4, kShaft_mm = 14.25, kDrum_mm = 110;
constexpr double kRadiansACount = 2 * std::numbers::pi / kCountsATurn * kShaft_mm / kDrum_mm;
constexpr double kAngleAtZero_rad = 35 * kDegree;
constexpr int kMaxCommand = 4095;
constexpr int kMaxNewtonSteps = 30;
constexpr double kAngleError_rad = 1e-12;
constexpr double kMaxNewtonStep_m = 0.03;
// Minimum of |det J| [rad³/m³], for J = dθ/dp. Away from singularities, a motor turns by about 15 rad per metre of the
// grip. Below the minimum the legs are almost fully stretched, so J⁻ᵀ is ill-conditioned.
constexpr double kMinDeterminant = 1.0;

struct LegAngles {
  double theta1, theta2, theta3;
};

/// Returns the joint angles of a leg; NaN if the leg does not reach p.
LegAngles leg_angles(const Vec3& p, double phi) {
  const double px = std::cos(phi) * p.x() + std::sin(phi) * p.y() - kMotorRadius;
  const double py = -std::sin(phi) * p.x() + std::cos(phi) * p.y() - kMotorOffset;
  const double pz = p.z();
  const double theta3 = std::acos((py + kF) / kShin);
  const double sin3 = std::sin(theta3);
  const double k = pz * pz + px * px + 2 * kC * px + kThigh * kThigh + kC * kC - kD * kD - kE * kE -
                   kShin * kShin * sin3 * sin3 - 2 * kShin * kE * sin3 - 2 * kShin * kD * sin3 - 2 * kD * kE;
  const double l0 = k - 2 * kThigh * px - 2 * kThigh * kC;
  const double l1 = -4 * kThigh * pz;
  const double l2 = k + 2 * kThigh * px + 2 * kThigh * kC;
  const double theta1 = 2 * std::atan((-l1 - std::sqrt(l1 * l1 - 4 * l0 * l2)) / (2 * l2));
  const double theta2 = std::acos((px - kThigh * std::cos(theta1) + kC) / (kD + kE + kShin * sin3));
  return {theta1, theta2, theta3};
}

}  // namespace

Vec3 falcon_angles(const FalconCounts& encoders) {
  return (encoders.cast<double>() * kRadiansACount).array() + kAngleAtZero_rad;
}

std::optional<Vec3> falcon_inverse(const Vec3& p_m) {
  Vec3 angles;
  for (int leg = 0; leg < 3; ++leg) angles[leg] = leg_angles(p_m, kLegs_rad[static_cast<std::size_t>(leg)]).theta1;
  if (!is_finite(angles)) return std::nullopt;
  return angles;
}

std::optional<Eigen::Matrix3d> falcon_jacobian(const Vec3& p_m) {
  Eigen::Matrix3d j;
  for (int leg = 0; leg < 3; ++leg) {
    const double phi = kLegs_rad[static_cast<std::size_t>(leg)];
    const LegAngles a = leg_angles(p_m, phi);
    const double sin3 = std::sin(a.theta3), cos3 = std::cos(a.theta3);
    const double across = std::cos(a.theta2) * sin3;
    const double denominator = -kThigh * sin3 * std::sin(a.theta1 - a.theta2);
    j.row(leg) << std::cos(phi) * across - std::sin(phi) * cos3, std::sin(phi) * across + std::cos(phi) * cos3,
        std::sin(a.theta2) * sin3;
    j.row(leg) /= denominator;
  }
  if (!j.allFinite()) return std::nullopt;
  return j;
}

std::optional<Vec3> falcon_forward(const Vec3& angles_rad, const Vec3& start_m) {
  if (!is_finite(angles_rad)) return std::nullopt;
  Vec3 p = start_m;
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    const std::optional<Vec3> angles = falcon_inverse(p);
    const std::optional<Eigen::Matrix3d> j = falcon_jacobian(p);
    if (!angles || !j) return std::nullopt;
    const Vec3 error = angles_rad - *angles;
    if (error.cwiseAbs().maxCoeff() < kAngleError_rad) return p;
    Vec3 step = clamped_to_length(j->inverse() * error, kMaxNewtonStep_m);
    // Near the edge of the workspace, a full Newton step may end outside of it, where the inverse kinematics has no
    // solution. The step is therefore halved until it ends inside.
    for (int halved = 0; halved < 10 && !falcon_inverse(p + step); ++halved) step *= 0.5;
    p += step;
  }
  return std::nullopt;
}

std::optional<Vec3> falcon_torques(const Vec3& p_m, const Vec3& force_on_hand_n) {
  const std::optional<Eigen::Matrix3d> j = falcon_jacobian(p_m);
  if (!j || !(std::abs(j->determinant()) > kMinDeterminant)) return std::nullopt;
  const Vec3 torques = j->inverse().transpose() * force_on_hand_n;
  if (!is_finite(torques)) return std::nullopt;
  return torques;
}

FalconCounts falcon_motor_counts(const Vec3& torques_n_m, double counts_per_n_m) {
  const Vec3 wanted = -counts_per_n_m * torques_n_m;
  if (!is_finite(wanted)) return FalconCounts::Zero();
  const double largest = wanted.cwiseAbs().maxCoeff();
  const double scale = largest > kMaxCommand ? kMaxCommand / largest : 1.0;
  FalconCounts counts;
  for (int motor = 0; motor < 3; ++motor) counts[motor] = static_cast<int>(std::trunc(wanted[motor] * scale));
  return counts.cwiseMax(-kMaxCommand).cwiseMin(kMaxCommand);
}

}  // namespace tandem::devices

// Kinematics of the Falcon: position of the grip from the angles of three motors, and torques for a force.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/spatial.hpp"

namespace tandem::devices {

using FalconCounts = Eigen::Matrix<int, 3, 1>;  ///< counts of the three encoders, or for the three motors

/// Angles from encoder counts.
/// Source  encoder of 320 slots with four edges each on a motor shaft of 14.25 mm that drives a drum of 110 mm, 35° at
///         count 0: libnifalcon, FalconGeometry.h
Vec3 falcon_angles(const FalconCounts& encoders);

/// θ1 of each leg [rad] for the grip at p [m], in the device's own frame: x right, y up, z out towards the user.
///
/// Model   a delta robot. In the frame of a leg, rotated by φ about z and shifted to its motor, the grip is at P. Its
///         parallelogram is inclined by θ3 = acos((Py + f)/b). With t = tan(θ1/2) the loop of the thigh closes where l2
///         t² + l1 t + l0 = 0
/// Source  R. E. Stamper, "A three degree of freedom parallel manipulator with only translational degrees of freedom",
///         PhD thesis, University of Maryland, 1997; geometry from libnifalcon
/// Fails   empty: out of reach
std::optional<Vec3> falcon_inverse(const Vec3& p_m);

/// Jacobian dθ1/dp [rad/m], one row per leg. libnifalcon has sin²θ2 in the z column, which differs from central
/// differences of the inverse by 2 to 5.5 rad/m; this one by less than 1e-7.
/// Fails   empty: out of reach
std::optional<Eigen::Matrix3d> falcon_jacobian(const Vec3& p_m);

/// Position of the grip at these angles, by Newton's method from `start`: full steps, to 1e-12 rad.
/// Fails   empty: no such position, or not found within 30 steps
std::optional<Vec3> falcon_forward(const Vec3& angles_rad, const Vec3& start_m = Vec3(0, 0, 0.125));

/// Motor torques about θ1 [N·m] that apply this force [N] to the hand: τ = J⁻ᵀ F, because F·v = τ·θ̇.
/// Fails   empty: out of reach, or near a singularity of the mechanism
std::optional<Vec3> falcon_torques(const Vec3& p_m, const Vec3& force_on_hand_n);

/// Motor counts −counts_per_n_m · τ, all three scaled together to at most ±4095: the direction is kept, and no number
/// wraps. Non-finite input gives zero.
FalconCounts falcon_motor_counts(const Vec3& torques_n_m, double counts_per_n_m);

}  // namespace tandem::devices

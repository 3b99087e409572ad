// Kinematics of the Falcon: position of the grip from the three motor angles, and motor torques for a force.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/spatial.hpp"

namespace tandem::devices {

using FalconCounts = Eigen::Matrix<int, 3, 1>;  ///< counts of the three encoders, or commands for the three motors

/// Returns the motor angles for encoder counts.
/// Source  libnifalcon, FalconGeometry.h: encoder with 320 slots of four edges each, on a motor shaft of 14.25 mm that
///         drives a drum of 110 mm; the angle is 35° at count 0
Vec3 falcon_angles(const FalconCounts& encoders);

/// Returns the angle θ1 of each leg [rad] for a position p of the grip [m] in the device's frame: x right, y up, z
/// towards the user.
///
/// Model   Delta robot. Each leg has a frame that is rotated by φ about z and shifted to the leg's motor; P is the
///         position of the grip in this frame. Two equations give the angles of a leg:
///         1. The angle of the parallelogram is θ3 = acos((Py + f)/b), with the shin length b and the joint offset f.
///         2. With t = tan(θ1/2), the kinematic loop is closed if l2 t² + l1 t + l0 = 0. falcon_kinematics.cpp computes
///            l0, l1 and l2.
/// Source  R. E. Stamper, "A three degree of freedom parallel manipulator with only translational degrees of freedom",
///         PhD thesis, University of Maryland, 1997; geometry from libnifalcon
/// Fails   returns nothing: p is out of reach
std::optional<Vec3> falcon_inverse(const Vec3& p_m);

/// Returns the Jacobian dθ1/dp [rad/m], one row per leg. It agrees with central differences of falcon_inverse() to
/// within 1e-7. The formula in libnifalcon is not used, because its z column has sin²θ2 and is wrong by 2 to 5.5 rad/m.
/// Fails   returns nothing: p is out of reach
std::optional<Eigen::Matrix3d> falcon_jacobian(const Vec3& p_m);

/// Returns the position of the grip for motor angles, by Newton's method from `start`. It ends when all angles agree to
/// 1e-12 rad.
/// Fails   returns nothing: no position has these angles, or 30 steps do not find it
std::optional<Vec3> falcon_forward(const Vec3& angles_rad, const Vec3& start_m = Vec3(0, 0, 0.125));

/// Returns the motor torques about θ1 [N·m] that apply a force [N] to the hand: τ = J⁻ᵀ F, because F·v = τ·θ̇.
/// Fails   returns nothing: p is out of reach, or near a singularity of the mechanism
std::optional<Vec3> falcon_torques(const Vec3& p_m, const Vec3& force_on_hand_n);

/// Returns the motor commands −counts_per_n_m · τ. If a command exceeds ±4095, all three are scaled down together, so
/// that the direction is kept and no number overflows. Input that is not finite gives zero.
FalconCounts falcon_motor_counts(const Vec3& torques_n_m, double counts_per_n_m);

}  // namespace tandem::devices

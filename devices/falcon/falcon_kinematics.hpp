// Where the Falcon's grip is, from the angles of its three motors, and which torques make a force.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/spatial.hpp"

namespace tandem::devices {

using FalconCounts = Eigen::Matrix<int, 3, 1>;  ///< of the three encoders, or to the three motors

/// Source  an encoder of 320 slots with four edges each on a motor shaft of 14.25 mm that drives a drum of 110 mm, 35° at
///         count 0: libnifalcon, FalconGeometry.h
Vec3 falcon_angles(const FalconCounts& encoders);

/// θ1 of each leg [rad] for the grip at p [m], in the device's own frame: x right, y up, z out towards the user.
///
/// Model   a delta robot. In the frame of a leg, turned by φ about z and moved to its motor, the grip is at P; its
///         parallelogram leans by θ3 = acos((Py + f)/b), and with t = tan(θ1/2) the thigh's loop closes where
///         l2 t² + l1 t + l0 = 0
/// Source  R. E. Stamper, "A three degree of freedom parallel manipulator with only translational degrees of freedom",
///         PhD thesis, University of Maryland, 1997; geometry as libnifalcon has it
/// Fails   none: out of reach
std::optional<Vec3> falcon_inverse(const Vec3& p_m);

/// dθ1/dp [rad/m], one leg a row. libnifalcon has sin²θ2 in the z column: against central differences of the inverse that
/// is off by 2 to 5.5 rad/m, and this one by less than 1e-7.
/// Fails   none: out of reach
std::optional<Eigen::Matrix3d> falcon_jacobian(const Vec3& p_m);

/// The grip at these angles, by Newton's method from `start`: full steps, to 1e-12 rad.
/// Fails   none: no such place, or not found within 30 steps
std::optional<Vec3> falcon_forward(const Vec3& angles_rad, const Vec3& start_m = Vec3(0, 0, 0.125));

/// Torques of the motors about θ1 [N·m] that put this force [N] on the hand: τ = J⁻ᵀ F, as F·v = τ·θ̇.
/// Fails   none: out of reach, or where the mechanism is singular
std::optional<Vec3> falcon_torques(const Vec3& p_m, const Vec3& force_on_hand_n);

/// −counts_per_n_m · τ, all three scaled together to at most ±4095: the direction is kept, and no number ever wraps.
/// Anything not finite gives zero.
FalconCounts falcon_motor_counts(const Vec3& torques_n_m, double counts_per_n_m);

}  // namespace tandem::devices

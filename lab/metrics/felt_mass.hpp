// Estimates the apparent mass that a hand perceives when it shakes an object.
#pragma once

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// An apparent mass. Its 95 % confidence interval is mass_kg ± half_width_kg. Both values are NaN if the mass could not
/// be measured.
struct FeltMass {
  double mass_kg = 0;
  double half_width_kg = 0;
};

/// Name of the phase of a hand's path in which the hand shakes the held object. The first second and the last half
/// second of the phase are excluded.
inline constexpr const char* kShakePhase = "shake";

/// Estimates the mass by regression of the displayed force on the motion of the same hand at the same time.
///
/// Model   −f_k = m a_k + b v_k + c x_k + offset, fitted to all three axes together, with one offset for each axis.
///         * m, b, c: fitted mass [kg], damping [N·s/m] and stiffness [N/m]
///         * f_k: mean of the forces held before and after tick k
///         * a_k: central difference of the true velocity over the same two periods
///         * v_k, x_k: velocity and position of the hand at tick k
/// Source  ordinary least squares. The confidence interval uses the covariance estimate of Newey and West (Econometrica
///         55, 1987: "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
///         matrix") with a lag of 0.2 s, because successive residuals are correlated Limits at a single frequency, a
///         spring cannot be distinguished from a negative mass. Therefore the motion must contain several frequencies
///         in the range 0.5–5 Hz
/// Fails   NaN if the phase is missing or shorter than 2 s, or if the hand hardly moves in it
FeltMass felt_mass(const UserTrace& user);

}  // namespace tandem::lab

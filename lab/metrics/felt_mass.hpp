// Apparent mass that a hand would estimate by shaking an object.
#pragma once

#include "lab/session/trace.hpp"

namespace tandem::lab {

/// An apparent mass with its 95 % confidence interval ± half_width_kg. NaN: not measured.
struct FeltMass {
  double mass_kg = 0;
  double half_width_kg = 0;
};

/// Phase of a hand's path in which it shakes the held object. The first second and the last half second are left out.
inline constexpr const char* kShakePhase = "shake";

/// Regression of the displayed force on the hand's own movement, in hand time.
///
/// Model   −f_k = m a_k + b v_k + c x_k + offset of each axis, all three axes together; f_k the mean of the forces held
///         before and after tick k, a_k the central difference of the true velocity over the same two periods
/// Source  ordinary least squares with Newey and West's covariance (Econometrica 55, 1987: "A simple, positive
///         semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix"), because the samples of
///         a ringing residual are not independent; lag 0.2 s
/// Limits  a spring is distinguished from a mass only over a band of frequencies: 0.5–5 Hz
/// Fails   NaN without the phase, with less than 2 s of it, or if the hand hardly moves in it
FeltMass felt_mass(const UserTrace& user);

}  // namespace tandem::lab

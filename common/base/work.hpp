// Work across a port, as every energy balance here counts it.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem {

/// What a wrench about a frame's origin, held while the frame goes from `from` to `to`, does on it [J].
///
/// Model   f · (p_to − p_from) + τ · θ, θ the short way from q_from to q_to
/// Thread  any; no allocation
inline double held_work_j(const Wrench& wrench, const Pose& from, const Pose& to) {
  return wrench.f.dot(to.p - from.p) + wrench.t.dot(rotation_vector(to.q * from.q.conjugate()));
}

}  // namespace tandem

// Wrench of soft bodies on a rigid object between two steps of the soft bodies. It is linearised and limited in range.
#pragma once

#include "common/base/touch_exchange.hpp"

namespace tandem::physics {

/// Returns the wrench of the soft bodies on the rigid object T, about the origin of T, for T at `X_WT`.
///
/// Model   W = W₀ − K (X − X₀), where W₀, K and X₀ are the wrench, the stiffness and T's pose at the last soft step. W
///         is continuous everywhere.
///         Along the force f₀ of W₀ the contact is a spring: the force increases with depth up to 50 mm and decreases
///         with retraction, but never attracts. If the component of the force along f₀ falls below a quarter of |f₀|,
///         all of W is scaled down in proportion. W is zero where this component would change sign.
///         Lateral and rotational displacements are clamped to the trust radius. Between one and four times the trust
///         radius W fades to zero, because T has then left the contact
/// Limits  a body that is squeezed from two opposite sides is held too weakly. The forces of both sides cancel in W₀,
///         and the direction f₀ that is used to prevent attraction is that of the small net force
/// Thread  any; no allocation; finite for finite input
Wrench soft_wrench(const SoftContact& contact, const Pose& X_WT) noexcept;

}  // namespace tandem::physics

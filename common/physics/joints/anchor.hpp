// A spring to a place for a body that an engine without springs steps.
#pragma once

#include "common/physics/joints/joint.hpp"
#include "common/physics/rigid_body.hpp"

namespace tandem::physics {

/// What a joint from the body's origin to `X_target` at rest does to the body in the next step, about its centre
/// of mass.
///
/// Model   implicit Euler of the body alone: M (V⁺ − V) = h w + h Jᵀ F, F = −K (e + h J V⁺) − D J V⁺, V of the centre,
///         J to the body's origin, e from the target to the body. Damps for every mass, stiffness and step:
///         M + h Jᵀ (D + h K) J has no eigenvalue below M's. What the engine adds by contact is foreseen by neither.
/// In      wrench_W  w: what else acts in that step (weight, fields), about the centre of mass
/// Source  our derivation
/// Out     zero where it would not be finite
/// Cost    one 6×6 factorisation, no allocation
Wrench anchor_wrench_W(const RigidBody& body, const Pose& X_target, const Joint& joint, const Wrench& wrench_W,
                       double step_s) noexcept;

}  // namespace tandem::physics

// Workspace mapping: scales the motion of a desk-sized device to a scene of a different size without creating energy.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem {

/// Maps handle poses from the device base D to the world W, and wrenches on the hand from W back to D.
///
/// Model   p_WH = p_WD + s_p R_WD p_DH,  R_WH = R_WD R_DH (rotation is never scaled)
///         f_D = s_f R_WD⁻¹ f_W,  τ_D = (s_f / s_p) R_WD⁻¹ τ_W
///         H is the handle; f and τ are force and torque on the hand. For each of the six components,
///         power at the hand = (s_f / s_p) · power in the world. This common factor makes the mapping passive.
struct WorkspaceMapping {
  Pose X_WD;
  double position_scale = 1.0;  ///< s_p, world metres per device metre, > 0
  double force_scale = 1.0;     ///< s_f, device newtons per world newton, > 0

  Pose world_pose(const Pose& X_DH) const {
    return {X_WD.p + X_WD.q * (position_scale * X_DH.p), (X_WD.q * X_DH.q).normalized()};
  }
  Twist world_twist(const Twist& V_DH) const { return {X_WD.q * (position_scale * V_DH.v), X_WD.q * V_DH.w}; }
  Wrench device_wrench(const Wrench& wrench_on_hand_W) const {
    const Quat q_DW = X_WD.q.conjugate();
    return {q_DW * (force_scale * wrench_on_hand_W.f), q_DW * (hand_joules_per_world_joule() * wrench_on_hand_W.t)};
  }
  /// Maps a wrench from D to W; the inverse of device_wrench().
  Wrench world_wrench(const Wrench& wrench_on_hand_D) const {
    return {X_WD.q * (wrench_on_hand_D.f / force_scale), X_WD.q * (wrench_on_hand_D.t / hand_joules_per_world_joule())};
  }
  double hand_joules_per_world_joule() const { return force_scale / position_scale; }
};

}  // namespace tandem

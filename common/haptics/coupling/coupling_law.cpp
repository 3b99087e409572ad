#include "common/haptics/coupling/coupling_law.hpp"

namespace tandem::haptics {

CouplingState coupling_state(const Pose& X_WH, const Twist& V_WH, const Pose& X_WT, const Twist& V_WT) {
  const Vec3 d_W = X_WH.p - X_WT.p;
  const Vec3 v_W = V_WH.v - V_WH.w.cross(d_W) - V_WT.v;
  return {d_W, rotation_vector(X_WH.q * X_WT.q.conjugate()), v_W, V_WH.w - V_WT.w, V_WH.v, V_WH.w};
}

CouplingWrenches coupling_wrenches(const CouplingLaw& law, const Pose& X_WH, const Twist& V_WH, const Pose& X_WT,
                                   const Twist& V_WT) noexcept {
  const CouplingState state = coupling_state(X_WH, V_WH, X_WT, V_WT);
  const Wrench on_tool = law.wrench_on_tool_W(state);
  return {on_tool, reaction_on_hand(on_tool, state.d_W)};
}

}  // namespace tandem::haptics

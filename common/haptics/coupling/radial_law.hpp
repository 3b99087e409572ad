// What all laws with a spring have in common: an elastic part along the displacement, a damper, and one limit on the
// sum of both, for force and torque apart. A law adds its curve.
#pragma once

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/coupling/radial.hpp"

namespace tandem::haptics {

/// The half of the parameters that translation or rotation uses: N and m, or N·m and rad.
struct CouplingChannel {
  double stiffness = 0;
  double damping = 0;
  double limit = 0;
  double softness = 0;
  double sharpness = 0;
};

/// Law of the form f = S(e(|d|) d̂ + b v), τ alike of θ and ω.
///
/// Model   e  the law's curve, not falling; S  saturated() with F_max, ε; v past the tool. S is the gradient of
///         a convex function, so (S(e + b v) − S(e))·v ≥ 0: the damper takes energy also where the limit bends the sum,
///         and what the elastic part stores is the integral of S(e), a function of |d| alone. θ turns along its own
///         axis (d|θ|/dt = θ̂·ω), so the same holds for τ.
///         Gradient: K = radial_gradient() of e, G = saturation_gradient(): ∂f/∂d = K^½ G K^½, which has the
///         eigenvalues of the exact G K, and ∂f/∂v = b G, exact
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 3.4, 3.5, 5.10: the whole force is bent, spring and damper. Gradient and
///         the reason of passivity are our derivation
/// Cost    no allocation; `tandem-lab bench coupling`
class RadialLaw : public CouplingLaw {
 public:
  /// A coefficient that is negative or not finite (a polynomial fit may dip below zero) counts as 0.
  void set_parameters(const CouplingParameters& parameters) noexcept final;
  Wrench wrench_on_tool_W(const CouplingState& state) const noexcept final;
  CouplingGradient gradient(const CouplingState& state) const noexcept final;

 protected:
  explicit RadialLaw(const CouplingParameters& parameters) noexcept { RadialLaw::set_parameters(parameters); }

 private:
  /// In      displacement ≥ 0; is_pushing  the handle moves away from the tool or stands, d·v_WH ≥ 0 (θ·ω_WH ≥ 0)
  virtual RadialStiffness elastic(const CouplingChannel& channel, double displacement,
                                  bool is_pushing) const noexcept = 0;
  Vec3 pull(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
            const Vec3& handle_velocity) const noexcept;
  struct Slopes {
    Eigen::Matrix3d by_displacement = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d by_velocity = Eigen::Matrix3d::Zero();
  };
  Slopes slopes(const CouplingChannel& channel, const Vec3& displacement, const Vec3& velocity,
                const Vec3& handle_velocity) const noexcept;

  CouplingChannel translation_;
  CouplingChannel rotation_;
};

}  // namespace tandem::haptics

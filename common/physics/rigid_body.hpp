// A rigid body of the world. Its state is set and returned for the body frame B, but stored for the centre of mass C.
#pragma once

#include "common/base/mass_properties.hpp"

namespace tandem::physics {

/// Properties of a body other than its mass and shape.
struct BodyTraits {
  double friction = 0.5;
  double restitution = 0;
  double linear_damping_per_s = 0;
  double angular_damping_per_s = 0;
  bool has_gravity = true;
};

class RigidBody {
 public:
  /// In      radius_m  radius of the bounding sphere about C; must be above 0
  RigidBody(const MassProperties& mass, const BodyTraits& traits, double radius_m, const Pose& X_WB);

  bool is_static() const { return mass_.mass_kg <= 0; }
  const MassProperties& mass() const { return mass_; }
  const BodyTraits& traits() const { return traits_; }
  double friction() const { return traits_.friction; }
  double radius_m() const { return radius_m_; }  ///< radius of the bounding sphere about C

  RigidState state() const;
  const Pose& pose() const { return X_WB_; }  ///< pose of B
  void set_state(const RigidState& state);
  /// Pose of C, whose axes are the principal axes of inertia.
  const Pose& centre_pose() const { return X_WC_; }
  void set_centre(const Pose& X_WC, const Twist& V_WC);
  /// Velocity of the body's point that is currently at `p_W`.
  Vec3 velocity_at_W(const Vec3& p_W) const { return V_WC_.v + V_WC_.w.cross(p_W - X_WC_.p); }
  /// Adds a wrench about the point `p_W` that acts in the next step.
  void apply_wrench(const Wrench& wrench_W, const Vec3& p_W);
  /// Sum of the wrenches applied since the last step, about the centre of mass.
  const Wrench& applied_W() const { return applied_W_; }

  /// Damps the velocity with the body's damping rates plus `extra_per_s`. The decay is computed as an exponential and
  /// is therefore stable at any rate.
  void damp(double step_s, double extra_per_s);
  /// Limits the speed of the centre of mass, and the speed that rotation causes at the bounding radius. Returns true if
  /// one of them exceeded the limit.
  bool limit_speed(double limit_m_per_s, double step_s);
  bool is_finite() const { return tandem::is_finite(X_WC_) && tandem::is_finite(V_WC_); }
  const Vec3& centre_W() const { return X_WC_.p; }
  const Twist& velocity_of_centre_W() const { return V_WC_; }
  Eigen::Matrix3d inertia_W() const;  ///< inertia about the centre of mass
  /// Returns the acceleration caused by a wrench about the centre of mass.
  Twist acceleration_W(const Wrench& wrench_W) const;
  /// Weight about the centre of mass: m g, or zero for a body without gravity.
  Wrench weight_W(const Vec3& gravity_m_per_s2) const;
  /// Moves the body by a step, and clears the applied wrenches. `V_WC` is the velocity of the centre that the solver
  /// has computed for the present attitude.
  ///
  /// Model   The attitude follows from Euler's equations for the angular momentum of `V_WC.w`, which is constant during
  ///         the step. They are integrated by the implicit midpoint rule, in substeps of at most 0.02 rad. The new
  ///         velocity has the same angular momentum in the new attitude. A free top therefore precesses, and its energy
  ///         is conserved.
  /// Source  our derivation
  void advance(const Twist& V_WC, double step_s);
  /// Moves the body by a step with exactly the velocity `V_WC`, for a prescribed motion. Clears the applied wrenches.
  void move(const Twist& V_WC, double step_s);
  /// Displaces the body by the small displacement `by_W`, whose rotation is about the centre of mass. Adds `dv` to the
  /// velocity of the centre.
  void shift(const Pose& by_W, const Twist& dv);
  /// Kinetic energy plus, for a body with gravity, potential energy in `gravity_m_per_s2`.
  double mechanical_energy_j(const Vec3& gravity_m_per_s2) const;

 private:
  MassProperties mass_;
  BodyTraits traits_;
  double radius_m_;
  Pose X_CB_;
  Pose X_WC_;
  Pose X_WB_;  ///< computed from X_WC_
  Twist V_WC_;
  Wrench applied_W_;
};

}  // namespace tandem::physics

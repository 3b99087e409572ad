// A rigid body of the world: its state, seen by its body frame B and kept at its centre of mass C.
#pragma once

#include "common/base/mass_properties.hpp"

namespace tandem::physics {

/// How a body behaves beside its mass and shape.
struct BodyTraits {
  double friction = 0.5;
  double restitution = 0;
  double linear_damping_per_s = 0;
  double angular_damping_per_s = 0;
  bool has_gravity = true;
};

class RigidBody {
 public:
  /// In      radius_m  of the ball about C that holds everything; > 0
  RigidBody(const MassProperties& mass, const BodyTraits& traits, double radius_m, const Pose& X_WB);

  bool is_static() const { return mass_.mass_kg <= 0; }
  const MassProperties& mass() const { return mass_; }
  const BodyTraits& traits() const { return traits_; }
  double friction() const { return traits_.friction; }
  double radius_m() const { return radius_m_; }  ///< of the ball about C that holds everything

  RigidState state() const;
  const Pose& pose() const { return X_WB_; }  ///< of B
  void set_state(const RigidState& state);
  /// The same of C, whose axes are the principal ones.
  const Pose& centre_pose() const { return X_WC_; }
  void set_centre(const Pose& X_WC, const Twist& V_WC);
  /// Velocity of the point of the body that is now at `p_W`.
  Vec3 velocity_at_W(const Vec3& p_W) const { return V_WC_.v + V_WC_.w.cross(p_W - X_WC_.p); }
  /// For the next step: `wrench_W` about the point `p_W`.
  void apply_wrench(const Wrench& wrench_W, const Vec3& p_W);
  /// What has been applied since the last step, about the centre of mass.
  const Wrench& applied_W() const { return applied_W_; }

  /// Slows by the body's own damping and `extra_per_s`: exponential, so no rate is too high.
  void damp(double step_s, double extra_per_s);
  /// Slows to `limit`, at the centre of mass and at the rim alike; true when it had to.
  bool limit_speed(double limit_m_per_s, double step_s);
  bool is_finite() const { return tandem::is_finite(X_WC_) && tandem::is_finite(V_WC_); }
  const Vec3& centre_W() const { return X_WC_.p; }
  const Twist& velocity_of_centre_W() const { return V_WC_; }
  Eigen::Matrix3d inertia_W() const;  ///< about the centre of mass
  /// What a wrench about the centre of mass makes of its velocity, a second.
  Twist acceleration_W(const Wrench& wrench_W) const;
  /// m g where the body feels gravity, about its centre of mass.
  Wrench weight_W(const Vec3& gravity_m_per_s2) const;
  /// Moves for a step from the centre's velocity `V_WC` that a solver found, and discards what was applied.
  ///
  /// Model   the angular momentum of `V_WC.w` in the present attitude is constant over the step; the attitude follows
  ///         Euler's equations by the implicit midpoint rule, in substeps of 0.02 rad at most. The new velocity
  ///         has the same momentum in the new attitude, so a free top precesses and keeps its energy.
  /// Source  our derivation
  void advance(const Twist& V_WC, double step_s);
  /// Moves for a step with exactly this velocity, and discards what was applied. For things whose motion is given.
  void move(const Twist& V_WC, double step_s);
  /// Displaces by a small `by_W`, its turn about the centre of mass, and adds `dv` to the centre's velocity.
  void shift(const Pose& by_W, const Twist& dv);
  /// Kinetic, and potential in `gravity` where the body feels it.
  double mechanical_energy_j(const Vec3& gravity_m_per_s2) const;

 private:
  MassProperties mass_;
  BodyTraits traits_;
  double radius_m_;
  Pose X_CB_;
  Pose X_WC_;
  Pose X_WB_;  ///< follows from it
  Twist V_WC_;
  Wrench applied_W_;
};

}  // namespace tandem::physics

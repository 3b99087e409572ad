// A rigid body of the world, seen by its body frame B; Bullet, which keeps its state, only knows the centre-of-mass
// frame C. Private to the world.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>

#include "proto/state.hpp"
#include "server/collision_shape.hpp"

namespace tandem {

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
  RigidBody(std::unique_ptr<CollisionShape> shape, const MassProperties& mass, const BodyTraits& traits,
            const Pose& X_WB);

  bool is_static() const { return mass_.mass_kg <= 0; }
  const MassProperties& mass() const { return mass_; }
  double friction() const { return traits_.friction; }
  const CollisionShape& shape() const { return *shape_; }
  btRigidBody& bullet() { return *body_; }

  RigidState state() const;
  void set_state(const RigidState& state);
  /// Velocity of the point of the body that is now at `p_W`.
  Vec3 velocity_at_W(const Vec3& p_W) const;
  /// For the next step: `wrench_W` about the point `p_W`.
  void apply_wrench(const Wrench& wrench_W, const Vec3& p_W);

  /// Slows by the body's own damping and `extra_per_s`: exponential, so no rate is too high.
  void damp(double step_s, double extra_per_s);
  /// Slows to `limit`, at the centre of mass and at the rim alike; true when it had to.
  bool limit_speed(double limit_m_per_s, double step_s);
  bool is_finite() const;
  Vec3 centre_W() const;
  Twist velocity_of_centre_W() const;
  Eigen::Matrix3d inertia_W() const;  ///< about the centre of mass
  /// m g where the body feels gravity, about its centre of mass.
  Wrench weight_W(const Vec3& gravity_m_per_s2) const;
  /// Moves on with the centre's velocity `V_WC` for a step: what a solver outside of Bullet found.
  void advance(const Twist& V_WC, double step_s);
  /// Kinetic, and potential in `gravity` where the body feels it.
  double mechanical_energy_j(const Vec3& gravity_m_per_s2) const;

 private:
  std::unique_ptr<CollisionShape> shape_;
  MassProperties mass_;
  BodyTraits traits_;
  Pose X_CB_;
  std::unique_ptr<btRigidBody> body_;
};

}  // namespace tandem

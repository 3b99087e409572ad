// Soft contact data that a room sends to a client's local model. It contains numbers only, so that the physics and the
// wire format can share it without the wire format depending on physics.
#pragma once

#include <Eigen/Core>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"

namespace tandem {

/// The contact of one rigid body T with all soft bodies, linearised at the pose used by the soft step. If T is not in
/// contact yet, this is the predicted contact, linearised at a pose inside the soft body. soft_wrench()
/// (common/physics/soft_contact.hpp) evaluates the contact force.
struct SoftContact {
  Wrench wrench_W;  ///< wrench on T at X_WT0 about its origin: impulse of the soft step divided by the step's duration
  /// −∂W/∂X, symmetric and positive semidefinite; first the translation [m], then the rotation [rad]
  Mat6 stiffness = Mat6::Zero();
  Pose X_WT0;  ///< pose of T at which the contact is linearised; before contact, the predicted pose
  /// displacement of T within which the contact is valid; 0: T is neither in contact nor close to it
  double trust_radius_m = 0;
  double lever_m = 0;  ///< lever arm: a rotation by θ counts as a displacement of lever_m · θ
};

}  // namespace tandem

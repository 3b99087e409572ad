// Soft contact data that a room sends to a client's local model. Plain numbers, so that simulated worlds and the wire
// share them and the wire does not depend on physics.
#pragma once

#include <Eigen/Core>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"

namespace tandem {

/// The contact of one rigid body T with all soft bodies, linearised at the pose used by the soft step. If T does not
/// touch yet, it is the predicted contact, linearised at a pose inside the soft body. soft_wrench()
/// (common/physics/soft_contact.hpp) evaluates its force.
struct SoftContact {
  Wrench wrench_W;  ///< on T at X_WT0, about its origin: impulse of the soft step over its length
  /// −∂W/∂X, symmetric and positive semidefinite; translation [m], then rotation [rad]
  Mat6 stiffness = Mat6::Zero();
  Pose X_WT0;                 ///< pose of T at the linearisation; predicted before the touch
  double trust_radius_m = 0;  ///< displacement of T for which the contact is valid; 0: T neither touches nor is near
  double lever_m = 0;         ///< a rotation by θ counts as a displacement of lever · θ
};

}  // namespace tandem

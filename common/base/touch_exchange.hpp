// Data of a contact with soft bodies, which a room sends to a client's local model. The struct consists of numbers
// only. Physics and wire format can therefore both use the struct without depending on each other.
#pragma once

#include <Eigen/Core>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"

namespace tandem {

/// The contact of one rigid body T with all soft bodies, linearised at the pose of T that the soft step used. Before T
/// touches a soft body, this is the contact that is predicted for a pose of T inside the soft body. The function
/// soft_wrench() (common/physics/soft_contact.hpp) computes the contact force from it.
struct SoftContact {
  Wrench wrench_W;  ///< wrench on T at X_WT0 about its origin: impulse of the soft step divided by the step's duration
  /// Stiffness −∂W/∂X of the wrench W against the pose X, symmetric and positive semidefinite. The first three rows and
  /// columns belong to the translation [m], the last three to the rotation [rad].
  Mat6 stiffness = Mat6::Zero();
  Pose X_WT0;  ///< pose of T at which the contact is linearised; before contact, the predicted pose
  /// Displacement of T up to which the linearisation is valid [m]; 0: T is neither in contact nor close to contact.
  double trust_radius_m = 0;
  double lever_m = 0;  ///< lever arm [m]: a rotation by θ counts as a displacement of lever_m · θ
};

}  // namespace tandem

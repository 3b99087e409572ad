// What a room tells a client's local model of what a tool touches. Plain numbers, so that worlds and the wire share
// them and the wire needs nothing of physics.
#pragma once

#include <Eigen/Core>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"

namespace tandem {

/// The contact of one rigid thing T with all soft bodies, linearised at the pose that the soft step was made with. Or,
/// of a T that does not touch yet, the contact that it is going to have, linearised at a pose within the soft body.
/// soft_wrench() (common/physics/soft_contact.hpp) is the force that it gives.
struct SoftContact {
  Wrench wrench_W;  ///< on T at X_WT0, about its origin: impulse of the soft step over its length
  /// −∂W/∂X, symmetric, never negative; translation [m], then rotation [rad]
  Mat6 stiffness = Mat6::Zero();
  Pose X_WT0;                 ///< where T was, or will be
  double trust_radius_m = 0;  ///< how far T may move aside until the contact is another one; 0: none, nor near
  double lever_m = 0;         ///< a turn by θ counts as a way of lever · θ
};

}  // namespace tandem

// Mass distribution of a rigid body, as needed by the equations of motion.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem {

struct MassProperties {
  double mass_kg = 0;  ///< mass [kg]; 0: static body; the other members are then unset
  Pose X_BC;           ///< pose of frame C (centre of mass and principal axes) in the body frame B
  Vec3 principal_inertia_kg_m2 = Vec3::Zero();  ///< principal moments of inertia about C

  double smallest_inertia_kg_m2() const { return principal_inertia_kg_m2.minCoeff(); }
};

}  // namespace tandem

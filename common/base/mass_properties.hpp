// Mass distribution of a rigid body, as the simulation steps need it.
#pragma once

#include "common/base/spatial.hpp"

namespace tandem {

struct MassProperties {
  double mass_kg = 0;                           ///< 0: static; the rest is then unset
  Pose X_BC;                                    ///< centre of mass and principal axes C in the body frame B
  Vec3 principal_inertia_kg_m2 = Vec3::Zero();  ///< about C

  double smallest_inertia_kg_m2() const { return principal_inertia_kg_m2.minCoeff(); }
};

}  // namespace tandem

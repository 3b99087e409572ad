// Path of a hand that moves one mesh to another, presses, slides, twists and retracts: the same for every contact
// method and every resolution of the meshes.
#pragma once

#include "devices/sim/hand_path.hpp"
#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

/// Parameters of the hand's path. Speeds are the peak speeds of minimum-jerk movements.
struct TouchPlan {
  Vec3 direction_W = -Vec3::UnitZ();  ///< direction of approach
  Quat q_WA = Quat::Identity();       ///< orientation of A
  double press_m = 0.02;              ///< travel of the hand past the first contact
  double slide_m = 0.015;             ///< to each side
  double twist_rad = 0.35;            ///< to each side, about the direction of approach
  double approach_m = 0.02;           ///< gap at the start
  double speed_m_per_s = 0.06;
  double twist_speed_rad_per_s = 1.0;
};

/// Phases "approach", "press", "slide", "twist", "pull away". B is at the origin of W; A starts outside its box.
///
/// The first contact is found by repeated approach by the gap between the meshes' corners.
devices::HandPath touch_path(const ExactSurface& a, const ExactSurface& b, const TouchPlan& plan);

/// Start time of the phase of that name. Fails: std::invalid_argument when the path has none.
Duration begin_of_phase(const devices::HandPath& path, const std::string& name);

}  // namespace tandem::lab

// The path of a hand that brings one mesh to another, presses, slides, twists and leaves: the same for every contact
// method and every resolution of the meshes.
#pragma once

#include "devices/sim/hand_path.hpp"
#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

/// What the hand does. Speeds are the largest of each minimum-jerk movement.
struct TouchPlan {
  Vec3 direction_W = -Vec3::UnitZ();  ///< of approach
  Quat q_WA = Quat::Identity();       ///< how A is held
  double press_m = 0.02;              ///< of the hand, past the first contact
  double slide_m = 0.015;             ///< to each side
  double twist_rad = 0.35;            ///< to each side, about the direction of approach
  double approach_m = 0.02;           ///< gap at the start
  double speed_m_per_s = 0.06;
  double twist_speed_rad_per_s = 1.0;
};

/// Phases "approach", "press", "slide", "twist", "pull away". B stands at the origin of W; A starts outside its box.
///
/// The first contact is found by approaching in steps of the gap between the meshes' corners.
devices::HandPath touch_path(const ExactSurface& a, const ExactSurface& b, const TouchPlan& plan);

/// When the phase of that name begins. Fails: std::invalid_argument when the path has none.
Duration begin_of_phase(const devices::HandPath& path, const std::string& name);

}  // namespace tandem::lab

// Path of a hand that moves one mesh to another, presses, slides, twists and retracts. It is the same for every contact
// method and every resolution of the meshes.
#pragma once

#include "devices/sim/hand_path.hpp"
#include "lab/studies/contact/exact_overlap.hpp"

namespace tandem::lab {

/// Parameters of the hand's path. The speeds are the peak speeds of minimum-jerk movements.
struct TouchPlan {
  Vec3 direction_W = -Vec3::UnitZ();  ///< direction of approach
  Quat q_WA = Quat::Identity();       ///< orientation of A
  double press_m = 0.02;              ///< distance that the hand moves beyond the first contact
  double slide_m = 0.015;             ///< amplitude of the slide in each direction
  double twist_rad = 0.35;            ///< amplitude of the twist in each direction, about the direction of approach
  double approach_m = 0.02;           ///< gap between the objects at the start
  double speed_m_per_s = 0.06;
  double twist_speed_rad_per_s = 1.0;
};

/// Returns a path with the phases "approach", "press", "slide", "twist" and "pull away". B is at the origin of W; A
/// starts outside B's bounding box.
///
/// The first contact is found by iteration: A repeatedly moves towards B by the gap between the vertices of the meshes.
devices::HandPath touch_path(const ExactSurface& a, const ExactSurface& b, const TouchPlan& plan);

/// Returns the start time of the phase with that name. Fails: std::invalid_argument if the path has no such phase.
Duration begin_of_phase(const devices::HandPath& path, const std::string& name);

}  // namespace tandem::lab

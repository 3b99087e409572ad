// Landing tests: a hand lands its tool on a fixed object, and a tool falls to the ground. Both have bounds to satisfy.
#pragma once

#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/report/check.hpp"
#include "lab/studies/contact/touch_judgement.hpp"

namespace tandem::lab {

/// One landing, or one drop.
struct Landing {
  std::string name;  ///< "landing at 22 mm/s, 300 N/m", "drop on −x"
  TouchFigures figures;
  double speed_m_per_s = 0;  ///< speed of the hand until it presses; 0: a drop, without a hand
  double stiffness_n_per_m = 0;
  double stop_force_n = 0;     ///< step of the hand's force at a rigid stop, see landings()
  double stop_torque_n_m = 0;  ///< upper bound of the torque step at a rigid stop
  bool is_on_face = false;     ///< drops only, see drops()
  double rest_s = 0;           ///< drops only: start of rest below 1 mm/s; infinite: not within kDrop_s
  double kinetic_left_j = 0;   ///< kinetic energy at the end
};

inline constexpr double kDrop_s = 3;

/// Six landings: at 22, 60 and 300 mm/s, each with a coupling of 300 and of 2000 N/m, damped by damped_for() and
/// without force limits. The hand moves straight along `direction_W` from 5 mm before the first contact. Its speed is
/// constant until a spring of that stiffness would press with 3 N. It then stops within 10 ms and rests for 0.3 s.
///
/// Model   An inelastic rigid stop projects the velocities (v, 0) onto those that the contacts still allow, nearest by
///         kinetic energy. So the velocity changes by at most v: the coupling's damper b and the spring k stretched
///         for a step of T give the hand v·(b + k·T). And |ω|² I + m|v'|² + |ω|² I + m|v − v'|² = m v², where the
///         terms of v are at least half of m v²: |ω| ≤ v / (2 r), r = √(I/m) of the lightest axis. The hand's torque
///         steps by at most (b_r + k_r·T)·v / (2 r); the step is smaller where the contact is in line with the centre.
/// Source  our derivation; a frictionless contact at distance r beside the centre reaches the bound of ω
std::vector<Landing> landings(const TouchObject& tool, const TouchObject& fixed, const Vec3& direction_W,
                              double mass_kg, const Clock& clock);

/// Six drops without a hand: the tool falls 5 mm onto level ground that is 40 times as wide as its radius, once with
/// each side of its bounding box down. Centre of mass and moments of inertia are those of the filled box.
///
/// A drop is "on a face" if corners of the mesh within 10 µm of that side support the tool stably up to a tilt of
/// 1 in 10. Elsewhere the tool may keep rolling and rocking, because rolling on rigid ground dissipates nothing.
std::vector<Landing> drops(const TouchObject& tool, double mass_kg, const Clock& clock);

/// Checks. All: contact occurs, and contact creates at most 1 mJ. Landings: steps of the hand's force and torque are
/// at most 1.1 times those of a rigid stop, and contact is lost at most once. Drops on a face: the tool comes to rest.
std::vector<Check> landing_checks(const std::vector<Landing>& all);

boost::json::object to_json(const std::vector<Landing>& all);
/// The results as a table in text, without the checks.
std::string to_text(const std::vector<Landing>& all);

}  // namespace tandem::lab

// A hand lands its tool on the fixed thing, and a tool falls to the ground: what either is held against.
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
  double speed_m_per_s = 0;  ///< of the hand until it presses; 0: a drop, without a hand
  double stiffness_n_per_m = 0;
  double stop_force_n = 0;     ///< step of the hand's force when a rigid stop ends the tool's motion, see landings()
  double stop_torque_n_m = 0;  ///< likewise, at most
  bool is_on_face = false;     ///< of a drop, see drops()
  double rest_s = 0;           ///< of a drop: from then on slower than 1 mm/s; infinite: not within kDrop_s
  double kinetic_left_j = 0;   ///< at the end
};

inline constexpr double kDrop_s = 3;

/// Six: at 22, 60 and 300 mm/s with a coupling of 300 and of 2000 N/m, damped_for() the tool and without limits. The hand
/// comes straight along `direction_W` from 5 mm before the first contact, at constant speed until a spring of that
/// stiffness would press with 3 N, stops within 10 ms, and then is still for 0.3 s.
///
/// Model   A rigid stop that gives nothing back takes velocities (v, 0) to their projection on those that the contacts
///         still allow, nearest by kinetic energy. So it changes the velocity by v at most: the coupling's damper b and
///         the spring k stretched for a step of T give the hand v·(b + k·T). And |ω|² I + m|v'|² + |ω|² I + m|v − v'|² =
///         m v², where the terms of v are half of m v² at least: |ω| ≤ v / (2 r), r = √(I/m) of the lightest axis, and the
///         hand's torque steps by (b_r + k_r·T)·v / (2 r). It is less where the tool is met in front of its centre.
/// Source  our derivation; the bound of ω is reached by a contact without friction that is r beside the centre
std::vector<Landing> landings(const TouchObject& tool, const TouchObject& fixed, const Vec3& direction_W,
                              double mass_kg, const Clock& clock);

/// Six: the tool falls for 5 mm, without a hand, with each side of its bounding box down, on level ground 40 times as wide
/// as its radius. Centre of mass and moments of inertia are those of that box, full.
///
/// It falls on a face where corners of the mesh within 10 µm of that side carry it like a die: it stands until tilted by
/// a tenth. Elsewhere it may roll and rock on, for nothing that rolls on rigid ground loses anything.
std::vector<Landing> drops(const TouchObject& tool, double mass_kg, const Clock& clock);

/// Of all: something touches. Of a landing: steps of the hand's force and torque at most 1.1 times a rigid stop's, contact lost once at most, and
/// again of all: at most 1 mJ made by contact. Of a drop on a face: it comes to rest.
std::vector<Check> landing_checks(const std::vector<Landing>& all);

boost::json::object to_json(const std::vector<Landing>& all);
/// A table for people, without the checks.
std::string to_text(const std::vector<Landing>& all);

}  // namespace tandem::lab

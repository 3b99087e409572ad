// Landing tests: a hand lands its tool on a fixed object, or a tool falls to the ground. The results are checked
// against bounds.
#pragma once

#include <string>
#include <vector>

#include "common/base/json.hpp"
#include "lab/report/check.hpp"
#include "lab/studies/contact/touch_judgement.hpp"

namespace tandem::lab {

/// Results of one landing or one drop.
struct Landing {
  std::string name;  ///< e.g. "landing at 22 mm/s, 300 N/m" or "drop on −x"
  TouchFigures figures;
  double speed_m_per_s = 0;  ///< speed of the hand until the tool presses; 0: a drop, without a hand
  double stiffness_n_per_m = 0;
  double stop_force_n = 0;     ///< step of the hand's force that a rigid stop would cause; see landings()
  double stop_torque_n_m = 0;  ///< upper bound of the hand's torque step at a rigid stop
  bool is_on_face = false;     ///< whether the tool drops on a face; see drops()
  /// drops only: time after which the tool stays slower than 1 mm/s; infinite: not reached within kDrop_s
  double rest_s = 0;
  double kinetic_left_j = 0;  ///< kinetic energy of the tool at the end
};

inline constexpr double kDrop_s = 3;

/// Runs six landings: at 22, 60 and 300 mm/s, each with a coupling of 300 and of 2000 N/m. The coupling has no force
/// limits and the damping of damped_for(). The hand moves straight along `direction_W`, beginning 5 mm before the first
/// contact. Its speed is constant until a spring of the coupling's stiffness would press with 3 N. It then stops within
/// 10 ms and rests for 0.3 s.
///
/// Model   A rigid inelastic stop changes the tool's velocities from (v, 0) to the nearest ones that the contacts
///         permit. "Nearest" refers to the metric of kinetic energy, and the change is an orthogonal projection.
///         * v: speed of the hand [m/s]
///         * v', ω: velocity and angular velocity of the tool after the stop
///         * m, I: mass of the tool, and its smallest moment of inertia; r = √(I/m)
///         * b, k: damping and stiffness of the coupling; b_r, k_r: those of its rotation
///         * T: duration of one step
///
///         Force: the velocity changes by at most v, and the coupling is stretched for one step. Therefore the force on
///         the hand changes by at most v·(b + k·T).
///
///         Torque: the projection gives |ω|² I + m|v'|² + |ω|² I + m|v − v'|² = m v². The terms with v' are together at
///         least m v² / 2. Therefore |ω| ≤ v / (2 r), and the torque on the hand changes by at most (b_r + k_r·T)·v /
///         (2 r). The change is smaller if the line of contact passes through the centre of mass.
/// Source  our derivation; a frictionless contact at distance r from the centre attains the bound of ω
std::vector<Landing> landings(const TouchObject& tool, const TouchObject& fixed, const Vec3& direction_W,
                              double mass_kg, const Clock& clock);

/// Runs six drops without a hand. The tool falls 5 mm onto level ground that is 40 times as wide as its radius, once
/// for each side of its bounding box facing down. Centre of mass and moments of inertia are those of a solid box.
///
/// A drop is "on a face" if mesh vertices within 10 µm of the lower side support the tool stably up to a tilt of 1 in
/// 10. In other drops the tool may continue to roll and rock, because rolling on rigid ground dissipates no energy.
std::vector<Landing> drops(const TouchObject& tool, double mass_kg, const Clock& clock);

/// Returns the checks. For all runs: contact occurs and creates at most 1 mJ. For landings: the steps of the hand's
/// force and torque are at most 1.1 times those of a rigid stop, and contact is lost at most once. For drops on a face:
/// the tool comes to rest.
std::vector<Check> landing_checks(const std::vector<Landing>& all);

boost::json::object to_json(const std::vector<Landing>& all);
/// Returns the results as a text table, without the checks.
std::string to_text(const std::vector<Landing>& all);

}  // namespace tandem::lab

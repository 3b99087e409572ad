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
/// contact. The speed of the hand is constant until the coupling's spring would press with 3 N against a rigid object.
/// The hand then stops within 10 ms and rests for 0.3 s.
///
/// Model   Bounds of the steps of force and torque at a rigid inelastic stop. Symbols:
///         * v: speed of the hand [m/s]
///         * v', ω: velocity and angular velocity of the tool after the stop
///         * m, I: mass of the tool, and its smallest moment of inertia
///         * r = √(I/m): smallest radius of gyration of the tool
///         * b, k: damping and stiffness of the coupling; b_r, k_r: those of its rotation
///         * T: duration of one step
///
///         1. Stop: before the stop, the tool moves at v without rotation. The contacts permit only some velocities.
///            The stop projects the velocity onto them orthogonally, with the kinetic energy as the metric.
///         2. Force: the projection changes v by at most v, and the coupling is stretched for one step. Therefore the
///            force on the hand changes by at most v·(b + k·T).
///         3. Torque: kinetic energy after the stop plus energy of the change equals the energy before the stop. Thus
///            |ω|² I + m|v'|² + |ω|² I + m|v − v'|² = m v². The two terms with v' are together at least m v² / 2.
///            Therefore |ω| ≤ v / (2 r), and the torque on the hand changes by at most (b_r + k_r·T)·v / (2 r).
/// Source  our derivation. The bound of ω is attained by a frictionless contact whose normal passes the centre of mass
///         at the distance r
std::vector<Landing> landings(const TouchObject& tool, const TouchObject& fixed, const Vec3& direction_W,
                              double mass_kg, const Clock& clock);

/// Runs six drops without a hand: one for each side of the tool's bounding box, with that side facing down. The tool
/// falls 5 mm onto level ground. The ground is 40 times as wide as the tool's radius. The tool has the centre of mass
/// and the moments of inertia of a solid box.
///
/// A drop is "on a face" if the tool stands stably on its lower side up to a tilt of 1 in 10. Mesh vertices within 10
/// µm of the lowest one count as support. In other drops the tool may roll and rock until the end, because rolling on
/// rigid ground dissipates no energy.
std::vector<Landing> drops(const TouchObject& tool, double mass_kg, const Clock& clock);

/// Returns the checks of all runs:
/// * every run: contact occurs and generates at most 1 mJ;
/// * landings: the steps of the hand's force and torque are at most 1.1 times those of a rigid stop, and contact is
///   lost at most once;
/// * drops on a face: the tool comes to rest.
std::vector<Check> landing_checks(const std::vector<Landing>& all);

boost::json::object to_json(const std::vector<Landing>& all);
/// Returns the results as a text table, without the checks.
std::string to_text(const std::vector<Landing>& all);

}  // namespace tandem::lab

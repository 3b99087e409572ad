// Minimal simulation of one hand, one tool and one fixed object for comparing contact methods at 1 kHz. Our own
// contact and its peer follow the same path here and record the same trace.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/base/time.hpp"
#include "common/contact/contact_shape.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/haptics/coupling/coupling_law.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::lab {

struct TouchSettings {
  double step_s = 0.001;
  double mass_kg = 0.1;
  Vec3 gravity_m_per_s2 = Vec3::Zero();
  double friction = 0.5;
  /// Includes limits: the benchmark presses with up to 5 N, the saturation being a sharp corner. Damping is set by
  /// damped_for().
  haptics::CouplingParameters coupling{.force_limit_n = 5.0, .saturation_softness = 0};
};

/// One step of either method. Times depend on the machine; everything else is the same in every run.
struct TouchStep {
  Duration at{0};
  int phase = -1;
  Pose X_WT;  ///< after the step
  Wrench on_hand_W;
  std::uint32_t queries = 0;    ///< distance queries to a field
  std::uint32_t found = 0;      ///< contact points within the band
  std::uint32_t contacts = 0;   ///< contacts that press
  double reported_depth_m = 0;  ///< deepest contact as reported by the method
  double force_jump_n = 0;      ///< see run_touch()
  double kinetic_j = 0;         ///< kinetic energy of the tool after the step
  /// Work on the tool in this step: its gain in kinetic energy less the work of coupling and weight.
  double contact_work_j = 0;
  /// Energy before the step in the layers of the contacts, ½ stiffness · area · depth² each, and in the friction
  /// bristles.
  double contact_stored_j = 0;
  Duration query{0};
  Duration step{0};  ///< query and solver
  bool has_converged = true;
};

using TouchTrace = std::vector<TouchStep>;

/// Moments of inertia of a solid box.
Vec3 box_inertia_kg_m2(const Vec3& size_m, double mass_kg);
/// Returns `coupling` with damping for this tool: 0.7 of critical, in translation and in rotation.
haptics::CouplingParameters damped_for(haptics::CouplingParameters coupling, double mass_kg, const Vec3& inertia_kg_m2);

/// Default number of steps, larger than any path needs: a run ends at the end of its path.
inline constexpr std::size_t kWholePath = std::numeric_limits<std::size_t>::max();

/// Steps a tool with the mass of a solid box around `tool` along the path; `fixed` is at the origin of W.
///
/// The force jump is the error that a receiver of 16 reduced contacts feels when the next ones arrive. It is the net
/// wrench of the new reduced contacts less that of the previous ones, extrapolated by their own stiffness, less the
/// same difference for all contacts. Torque is divided by the contacts' spread.
/// In      clock  for TouchStep's times
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                     Duration begin = Duration{0}, std::size_t steps = kWholePath);

/// The same for `length`, with a hand whose pose and twist `hand_at` returns; the tool starts with that twist. A
/// coupling without stiffness means no hand: the tool falls.
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const std::function<RigidState(Duration)>& hand_at, Duration length, const TouchSettings& settings,
                     const Clock& clock);

/// Merges several equal runs into one trace with the shortest times of each step. This removes interruptions by other
/// work of the machine.
/// Fails   std::logic_error when the motions of the runs differ
TouchTrace fastest_of(const std::vector<TouchTrace>& runs);

/// The same with Bullet's GImpact on the exact triangles, its default solver, and the coupling as an external force.
TouchTrace run_gimpact(const geometry::TriangleMesh& tool, const geometry::TriangleMesh& fixed,
                       const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                       Duration begin = Duration{0}, std::size_t steps = kWholePath);

}  // namespace tandem::lab

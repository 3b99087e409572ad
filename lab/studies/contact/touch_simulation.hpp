// Minimal simulation of one hand, one tool and one fixed object at 1 kHz. It serves to compare contact methods: our own
// method and Bullet's GImpact follow the same path and record the same trace.
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
  /// Default coupling with a force limit of 5 N; saturation begins exactly at the limit. damped_for() sets its damping.
  haptics::CouplingParameters coupling{.force_limit_n = 5.0, .saturation_softness = 0};
};

/// One step of either contact method. The durations depend on the machine; all other values are the same in every run.
struct TouchStep {
  Duration at{0};
  int phase = -1;
  Pose X_WT;  ///< pose of the tool after the step
  Wrench on_hand_W;
  std::uint32_t queries = 0;    ///< number of distance queries to a grid
  std::uint32_t found = 0;      ///< number of contact points within the contact band
  std::uint32_t contacts = 0;   ///< number of active contacts
  double reported_depth_m = 0;  ///< depth of the deepest contact as reported by the method
  double force_jump_n = 0;      ///< force jump at this step; see run_touch()
  double kinetic_j = 0;         ///< kinetic energy of the tool after the step
  /// Work of the contact on the tool in this step. It is computed as the gain of kinetic energy minus the work of
  /// coupling and weight.
  double contact_work_j = 0;
  /// Energy stored before the step in the contact layers (½ stiffness · area · depth² for each contact) and in the
  /// friction bristles.
  double contact_stored_j = 0;
  Duration query{0};
  Duration step{0};  ///< duration of query and solver together
  bool has_converged = true;
};

using TouchTrace = std::vector<TouchStep>;

/// Returns the moments of inertia of a solid box.
Vec3 box_inertia_kg_m2(const Vec3& size_m, double mass_kg);
/// Returns `coupling` with damping for a tool of this mass and inertia: 0.7 of critical damping in translation and
/// rotation.
haptics::CouplingParameters damped_for(haptics::CouplingParameters coupling, double mass_kg, const Vec3& inertia_kg_m2);

/// Default number of steps: unlimited. The run ends at the end of the path.
inline constexpr std::size_t kWholePath = std::numeric_limits<std::size_t>::max();

/// Simulates a tool along the path. The tool has the mass and inertia of a solid box around `tool`; `fixed` is at the
/// origin of W.
///
/// A network client receives only 16 reduced contacts and extrapolates their wrench between updates. The force jump of
/// a step is the error of the force step that it displays at an update:
/// 1. The wrench of the previous reduced contacts is extrapolated to the new pose by the stiffness of these contacts.
/// 2. It is subtracted from the wrench of the new reduced contacts.
/// 3. The same difference, computed for all contacts, is subtracted from the result of step 2.
///
/// A torque error is divided by a lever arm, the largest distance of a contact from the tool's origin. The larger of
/// both errors counts.
/// In      clock  clock for the durations in TouchStep
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                     Duration begin = Duration{0}, std::size_t steps = kWholePath);

/// Simulates the tool for the duration `length`, with a hand whose pose and twist are returned by `hand_at`. The tool
/// starts with the hand's twist. If the coupling has no stiffness, there is no hand and the tool falls.
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const std::function<RigidState(Duration)>& hand_at, Duration length, const TouchSettings& settings,
                     const Clock& clock);

/// Merges several equal runs into one trace, with the shortest duration of each step. This removes interruptions by
/// other processes.
/// Fails   std::logic_error: the motions of the runs differ
TouchTrace fastest_of(const std::vector<TouchTrace>& runs);

/// Simulates the tool along the path with Bullet's GImpact on the exact triangles and Bullet's default solver. The
/// coupling acts as an external force.
TouchTrace run_gimpact(const geometry::TriangleMesh& tool, const geometry::TriangleMesh& fixed,
                       const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                       Duration begin = Duration{0}, std::size_t steps = kWholePath);

}  // namespace tandem::lab

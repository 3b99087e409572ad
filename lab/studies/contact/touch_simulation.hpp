// One hand, one tool, one fixed thing: the least that a contact method has to step a thousand times a second. Both our
// own contact and its peer run along the same path here and leave the same trace.
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
  /// Limits are part of it: 5 N, met with a corner, is how hard the benchmark presses. Damping is damped_for()'s.
  haptics::CouplingParameters coupling{.force_limit_n = 5.0, .saturation_softness = 0};
};

/// One step of either method. Times are of the machine; everything else is the same on every run.
struct TouchStep {
  Duration at{0};
  int phase = -1;
  Pose X_WT;  ///< after the step
  Wrench on_hand_W;
  std::uint32_t looks = 0;      ///< distances asked of a field
  std::uint32_t found = 0;      ///< contact points within the band
  std::uint32_t contacts = 0;   ///< those that press
  double reported_depth_m = 0;  ///< deepest contact as the method sees it
  double force_jump_n = 0;      ///< see run_touch()
  double kinetic_j = 0;         ///< of the tool, after the step
  /// On the tool in this step: what its kinetic energy gained less the work of coupling and weight.
  double contact_work_j = 0;
  /// In the layers of the contacts, before the step: ½ stiffness · area · depth² each; and in what friction has bent, likewise.
  double contact_stored_j = 0;
  Duration query{0};
  Duration step{0};  ///< query and solution
  bool has_converged = true;
};

using TouchTrace = std::vector<TouchStep>;

/// Moments of inertia of a solid box.
Vec3 box_inertia_kg_m2(const Vec3& size_m, double mass_kg);
/// `coupling` with damping for this tool: 0.7 of critical, in translation and in rotation.
haptics::CouplingParameters damped_for(haptics::CouplingParameters coupling, double mass_kg, const Vec3& inertia_kg_m2);

/// More steps than any path has: a run ends where the path does.
inline constexpr std::size_t kWholePath = std::numeric_limits<std::size_t>::max();

/// Steps a tool with the mass of a solid box around `tool` along the path; `fixed` stands at the origin of W.
///
/// The force jump is what a receiver of 16 reduced contacts would feel too much when the next ones come: their net
/// wrench against that of the last ones, carried on by their own stiffness, less the same for all contacts (torque over
/// the contacts' spread). In      clock  for TouchStep's times
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                     Duration begin = Duration{0}, std::size_t steps = kWholePath);

/// Likewise, for `length`, with the hand wherever `hand_at` says: its pose, and its twist, which the tool has at the
/// start too. A coupling without stiffness is no hand: the tool falls.
TouchTrace run_touch(const contact::ContactShape& tool, const contact::ContactShape& fixed,
                     const std::function<RigidState(Duration)>& hand_at, Duration length, const TouchSettings& settings,
                     const Clock& clock);

/// One trace of several equal runs: of each step the shortest times. What a step costs is then free of what else the
/// machine did meanwhile.
/// Fails   std::logic_error when the runs moved differently: then they were not equal
TouchTrace fastest_of(const std::vector<TouchTrace>& runs);

/// The same with Bullet's GImpact on the exact triangles, its default solver, and the coupling as an outside force.
TouchTrace run_gimpact(const geometry::TriangleMesh& tool, const geometry::TriangleMesh& fixed,
                       const devices::HandPath& path, const TouchSettings& settings, const Clock& clock,
                       Duration begin = Duration{0}, std::size_t steps = kWholePath);

}  // namespace tandem::lab

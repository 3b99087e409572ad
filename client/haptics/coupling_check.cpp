#include "client/haptics/coupling_check.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "devices/device_check.hpp"
#include "proto/world_from_wire.hpp"

namespace tandem::client {
namespace {

using Mat3 = Eigen::Matrix3d;

bool follows_what_is_moved(const haptics::CouplingLawInfo& law) {
  return law.tool == haptics::ToolDynamics::kMassless || law.name == "adaptive";
}

devices::LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                                    const physics::MovedMass& moved) {
  return devices::loop_coupling(law, parameters, moved.mass_kg, moved.inertia_kg_m2, moved.is_held_body);
}

bool is_graver(const haptics::StabilityFinding& a, const haptics::StabilityFinding& b) {
  if (a.verdict != b.verdict) return a.verdict > b.verdict;
  return a.spectral_radius > b.spectral_radius;
}

/// Adds a finding to `into`. For translation and for rotation, only the most severe finding is kept.
void merge(const haptics::StabilityFinding& finding, std::vector<haptics::StabilityFinding>& into) {
  const auto same = std::find_if(into.begin(), into.end(), [&](const haptics::StabilityFinding& other) {
    return other.is_rotation == finding.is_rotation;
  });
  if (same == into.end()) {
    into.push_back(finding);
  } else if (is_graver(finding, *same)) {
    *same = finding;
  }
}

/// Returns the coupling law of the scene; null if its index is invalid.
const haptics::CouplingLawInfo* law_of(const HapticScene& scene) {
  return scene.law < haptics::coupling_laws().size() ? &haptics::coupling_laws()[scene.law] : nullptr;
}
/// Returns the scene's coupling coefficients in world units, limited to the bounds of this device.
haptics::CouplingParameters rendered(const HapticScene& scene, const haptics::CouplingLawInfo& law,
                                     const devices::DeviceProfile& device) {
  return haptics::rendered_coupling(
      law.name, scene.coupling, haptics::coupling_bounds_in_world(devices::coupling_bounds(device), scene.workspace));
}

/// Reads mass properties from the server's message. A result is empty if the properties are missing or invalid.
class MassesOnWire {
 public:
  explicit MassesOnWire(const wire::Joined& joined) : joined_(joined) {}
  std::optional<MassProperties> tool() const { return at(joined_.tool_masses(), joined_.tool()); }
  std::optional<MassProperties> body(int index) const {
    return at(joined_.body_masses(), static_cast<std::uint32_t>(index));
  }

 private:
  template <class Masses>
  static std::optional<MassProperties> at(const Masses& masses, std::uint32_t index) {
    if (index >= static_cast<std::uint32_t>(masses.size())) return std::nullopt;
    const auto mass = proto::mass_from_wire(masses[static_cast<int>(index)]);
    return mass && mass->mass_kg > 0 ? mass : std::nullopt;
  }

  const wire::Joined& joined_;
};

bool can_be_grabbed(const wire::Body& body) {
  return body.graspable() && body.mass_kg() > 0;
}

/// Returns the eigenvalues of a symmetric matrix in ascending order.
Vec3 eigenvalues(const Mat3& matrix) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

/// Returns the smallest and the largest mass of `ends`, or a single mass if both are equal.
std::vector<physics::MovedMass> distinct(const std::array<physics::MovedMass, 2>& ends) {
  constexpr double kSame = 1 + 1e-9;
  const auto& [least, most] = ends;
  if (most.mass_kg <= kSame * least.mass_kg && most.inertia_kg_m2 <= kSame * least.inertia_kg_m2) return {most};
  return {least, most};
}

/// Returns the smallest range that contains both ranges.
std::array<physics::MovedMass, 2> widened(const std::array<physics::MovedMass, 2>& a,
                                          const std::array<physics::MovedMass, 2>& b) {
  return {{{std::min(a[0].mass_kg, b[0].mass_kg), std::min(a[0].inertia_kg_m2, b[0].inertia_kg_m2), true},
           {std::max(a[1].mass_kg, b[1].mass_kg), std::max(a[1].inertia_kg_m2, b[1].inertia_kg_m2), true}}};
}

haptics::StabilityFinding unknown_masses() {
  haptics::StabilityFinding finding;
  finding.verdict = haptics::StabilityVerdict::kUnstable;
  finding.parameter = "tool_masses, body_masses";
  finding.value = finding.rendered_value = finding.remedy = std::numeric_limits<double>::quiet_NaN();
  finding.text =
      "the server sends no usable mass and inertia of the tool or of a body that it could grab, so the mass that the "
      "coupling moves is not known; use a server of this version";
  return finding;
}

}  // namespace

std::array<physics::MovedMass, 2> resistance_at(const MassProperties& mass, const Vec3& p_BT, bool is_held_body) {
  const Vec3 c = mass.X_BC.p - p_BT;
  const Mat3 R_BC = mass.X_BC.q.toRotationMatrix();
  const Mat3 about_centre = R_BC * mass.principal_inertia_kg_m2.asDiagonal() * R_BC.transpose();
  const Mat3 mobility = R_BC * mass.principal_inertia_kg_m2.cwiseInverse().asDiagonal() * R_BC.transpose();
  Mat3 cross;
  cross << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  const Mat3 about_grip = about_centre + mass.mass_kg * cross.transpose() * cross;
  const Mat3 turning_free = Mat3::Identity() / mass.mass_kg + cross.transpose() * mobility * cross;
  return {{{1 / eigenvalues(turning_free)[2], mass.smallest_inertia_kg_m2(), is_held_body},
           {mass.mass_kg, eigenvalues(about_grip)[2], is_held_body}}};
}

std::vector<physics::MovedMass> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law,
                                               BodyId held, const Vec3* p_BT) {
  const MassesOnWire masses(joined);
  const std::optional<MassProperties> tool = masses.tool();
  if (!tool) return {};
  const auto of_tool = resistance_at(*tool, Vec3::Zero(), false);
  if (follows_what_is_moved(law) && !held.is_valid()) return distinct(of_tool);
  std::optional<std::array<physics::MovedMass, 2>> of_bodies;
  for (int i = 0; i < joined.scene().bodies_size(); ++i) {
    const bool is_held = held == body_id_at(static_cast<std::size_t>(i));
    if (follows_what_is_moved(law) ? !is_held : !can_be_grabbed(joined.scene().bodies(i))) continue;
    const std::optional<MassProperties> body = masses.body(i);
    if (!body) return {};
    const Vec3 at_B = is_held && p_BT != nullptr ? *p_BT : body->X_BC.p;
    const auto of_body = resistance_at(*body, at_B, true);
    if (follows_what_is_moved(law)) return distinct(of_body);
    of_bodies = of_bodies ? widened(*of_bodies, of_body) : of_body;
  }
  std::vector<physics::MovedMass> things = distinct(of_tool);
  if (!of_bodies) return things;
  const auto& [least, most] = *of_bodies;
  if (least.mass_kg < of_tool[0].mass_kg || least.inertia_kg_m2 < of_tool[0].inertia_kg_m2) things.push_back(least);
  if (most.mass_kg > of_tool[1].mass_kg || most.inertia_kg_m2 > of_tool[1].inertia_kg_m2) things.push_back(most);
  return things;
}

bool is_stable_coupling(const HapticScene& scene, const std::vector<physics::MovedMass>& moved,
                        const devices::DeviceProfile& profile) {
  const haptics::CouplingLawInfo* law = law_of(scene);
  if (law == nullptr) return true;
  const haptics::CouplingParameters parameters = rendered(scene, *law, profile);
  const haptics::LoopDevice device = devices::loop_device(profile, scene.workspace);
  return std::all_of(moved.begin(), moved.end(), [&](const physics::MovedMass& thing) {
    const devices::LoopCoupling coupling = loop_coupling(*law, parameters, thing);
    return haptics::is_stable_coupling(coupling.parameters, coupling.tool_mass_kg, coupling.tool_inertia_kg_m2, device,
                                       coupling.slope_factor);
  });
}

std::vector<haptics::StabilityFinding> explained(const CouplingCheck& check, const devices::DeviceProfile& profile) {
  const haptics::CouplingLawInfo* law = law_of(check.scene);
  if (check.number == 0 || law == nullptr) return {};
  if (check.moved.empty()) return {unknown_masses()};
  const haptics::CouplingParameters parameters = rendered(check.scene, *law, profile);
  const haptics::LoopDevice device = devices::loop_device(profile, check.scene.workspace);
  std::vector<haptics::StabilityFinding> findings;
  for (const physics::MovedMass& thing : check.moved) {
    const devices::LoopCoupling coupling = loop_coupling(*law, parameters, thing);
    for (const haptics::StabilityFinding& finding :
         haptics::check_coupling(coupling.parameters, coupling.tool_mass_kg, coupling.tool_inertia_kg_m2, device,
                                 coupling.slope_factor, &check.scene.coupling)) {
      merge(finding, findings);
    }
  }
  if (const auto active = devices::find_active_law(*law)) findings.push_back(*active);
  return findings;
}

void CouplingWatch::note_change(LocalTime now) {
  if (!waits_) latest_ = now + kAtLatest;
  waits_ = true;
  due_ = std::min(now + kQuiet, latest_);
}

void CouplingWatch::note_grip(BodyId body, const Vec3& p_BT, LocalTime now) {
  const bool is_known = body == gripped_ && (p_BT - grip_B_).norm() <= kGripMoved_m;
  if (is_known && body.is_valid()) return;
  gripped_ = body;
  grip_B_ = p_BT;
  if (body.is_valid()) note_change(now);
}

bool CouplingWatch::check(const HapticScene& scene, const wire::Joined& joined, BodyId held) {
  const haptics::CouplingLawInfo* law = law_of(scene);
  if (!device_ || law == nullptr) return true;
  ++last_.number;
  last_.scene = scene;
  // If the tool holds a body from the start, the join message does not name this body. The state updates do; gripped_
  // is the body that they name.
  const BodyId moved = held.is_valid() ? held : gripped_;
  last_.moved = things_to_move(joined, *law, moved, moved == gripped_ ? &grip_B_ : nullptr);
  last_.is_refused = last_.moved.empty() || !is_stable_coupling(scene, last_.moved, *device_);
  return !last_.is_refused;
}

}  // namespace tandem::client

#include "client/haptics/coupling_check.hpp"

#include <algorithm>

#include "client/haptics/rendered_coupling.hpp"
#include "devices/device_check.hpp"
#include "proto/state.hpp"

namespace tandem::client {
namespace {

/// Of a body of which only the mass is known: as of a pen of 5 cm, what the server takes a tool for at least. Ours.
double guessed_inertia(double mass_kg) {
  return mass_kg * 0.05 * 0.05 / 12;
}

bool follows_what_is_moved(const haptics::CouplingLawInfo& law) {
  return law.tool == haptics::ToolDynamics::kMassless || law.name == "adaptive";
}

devices::LoopCoupling loop_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters,
                                    const MovedThing& thing) {
  return devices::loop_coupling(law, parameters, thing.mass_kg, guessed_inertia(thing.mass_kg), thing.is_held_body);
}

bool is_graver(const haptics::StabilityFinding& a, const haptics::StabilityFinding& b) {
  if (a.verdict != b.verdict) return a.verdict > b.verdict;
  return a.spectral_radius > b.spectral_radius;
}

/// Of findings about the same direction of motion the graver stays.
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

/// What is to be checked, in numbers of the world; null where there is none.
const haptics::CouplingLawInfo* law_of(const HapticScene& scene) {
  return scene.law < haptics::coupling_laws().size() ? &haptics::coupling_laws()[scene.law] : nullptr;
}
haptics::CouplingParameters rendered(const HapticScene& scene, const haptics::CouplingLawInfo& law,
                                     const devices::DeviceProfile& device) {
  return rendered_coupling(law.name, scene.coupling, devices::coupling_bounds(device), scene.workspace);
}

}  // namespace

std::vector<MovedThing> things_to_move(const wire::Joined& joined, const haptics::CouplingLawInfo& law, BodyId held) {
  const wire::Scene& scene = joined.scene();
  if (joined.tool() >= static_cast<std::uint32_t>(scene.tools_size())) return {MovedThing{}};
  const MovedThing tool{scene.tools(static_cast<int>(joined.tool())).mass_kg(), false};
  std::optional<MovedThing> lightest, heaviest;
  for (int i = 0; i < scene.bodies_size(); ++i) {
    const MovedThing body{scene.bodies(i).mass_kg(), true};
    if (follows_what_is_moved(law)) {
      if (held == body_id_at(static_cast<std::size_t>(i))) return {body};
      continue;
    }
    if (!scene.bodies(i).graspable() || !(body.mass_kg > 0)) continue;
    if (!lightest || body.mass_kg < lightest->mass_kg) lightest = body;
    if (!heaviest || body.mass_kg > heaviest->mass_kg) heaviest = body;
  }
  std::vector<MovedThing> things{tool};
  if (lightest && lightest->mass_kg < tool.mass_kg) things.push_back(*lightest);
  if (heaviest && heaviest->mass_kg > tool.mass_kg) things.push_back(*heaviest);
  return things;
}

bool is_stable_coupling(const HapticScene& scene, const std::vector<MovedThing>& moved,
                        const devices::DeviceProfile& profile) {
  const haptics::CouplingLawInfo* law = law_of(scene);
  if (law == nullptr) return true;
  const haptics::CouplingParameters parameters = rendered(scene, *law, profile);
  const haptics::LoopDevice device = devices::loop_device(profile, scene.workspace);
  return std::all_of(moved.begin(), moved.end(), [&](const MovedThing& thing) {
    const devices::LoopCoupling coupling = loop_coupling(*law, parameters, thing);
    return haptics::is_stable_coupling(coupling.parameters, coupling.tool_mass_kg, coupling.tool_inertia_kg_m2, device,
                                       coupling.slope_factor);
  });
}

std::vector<haptics::StabilityFinding> explained(const CouplingCheck& check, const devices::DeviceProfile& profile) {
  const haptics::CouplingLawInfo* law = law_of(check.scene);
  if (check.number == 0 || law == nullptr) return {};
  const haptics::CouplingParameters parameters = rendered(check.scene, *law, profile);
  const haptics::LoopDevice device = devices::loop_device(profile, check.scene.workspace);
  std::vector<haptics::StabilityFinding> findings;
  for (const MovedThing& thing : check.moved) {
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

bool CouplingWatch::check(const HapticScene& scene, const wire::Joined& joined, BodyId held) {
  const haptics::CouplingLawInfo* law = law_of(scene);
  if (!device_ || law == nullptr) return true;
  ++last_.number;
  last_.scene = scene;
  last_.moved = things_to_move(joined, *law, held);
  last_.is_refused = !is_stable_coupling(scene, last_.moved, *device_);
  return !last_.is_refused;
}

}  // namespace tandem::client

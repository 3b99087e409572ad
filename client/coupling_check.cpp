#include "client/coupling_check.hpp"

#include <algorithm>

#include "common/coupling/laws.hpp"
#include "devices/device_check.hpp"

namespace tandem {
namespace {

/// Of a body of which only the mass is known: as of a pen of 5 cm, what the server takes a tool for at least. Ours.
double guessed_inertia(double mass_kg) {
  return mass_kg * 0.05 * 0.05 / 12;
}

/// As the haptic path bounds them: numbers of the world in, numbers of the world out.
CouplingParameters rendered(const CouplingParameters& asked, const DeviceProfile& profile, const LoopDevice& device,
                            double slope_factor) {
  const CouplingParameters bounds = coupling_bounds(profile);
  const double steepness = std::max(1.0, slope_factor);
  CouplingParameters result = asked;
  const auto bound = [&](double CouplingParameters::*value, double divisor) {
    result.*value = std::min(asked.*value, bounds.*value / divisor);
  };
  bound(&CouplingParameters::stiffness_n_per_m, steepness * device.coupling_scale);
  bound(&CouplingParameters::damping_n_s_per_m, device.coupling_scale);
  bound(&CouplingParameters::stiffness_n_m_per_rad, steepness * device.rotational_coupling_scale);
  bound(&CouplingParameters::damping_n_m_s_per_rad, device.rotational_coupling_scale);
  return result;
}

bool is_graver(const StabilityFinding& a, const StabilityFinding& b) {
  if (a.verdict != b.verdict) return a.verdict > b.verdict;
  return a.spectral_radius > b.spectral_radius;
}

/// Of findings about the same direction of motion the graver stays.
void merge(const StabilityFinding& finding, std::vector<StabilityFinding>& into) {
  const auto same = std::find_if(into.begin(), into.end(), [&](const StabilityFinding& other) {
    return other.is_rotation == finding.is_rotation;
  });
  if (same == into.end()) {
    into.push_back(finding);
  } else if (is_graver(finding, *same)) {
    *same = finding;
  }
}

}  // namespace

MassRange tool_masses(const wire::Joined& joined) {
  const wire::Scene& scene = joined.scene();
  if (joined.tool() >= static_cast<std::uint32_t>(scene.tools_size())) return {};
  const double own = scene.tools(static_cast<int>(joined.tool())).mass_kg();
  MassRange range{own, own};
  for (const wire::Body& body : scene.bodies()) {
    if (!body.graspable() || !(body.mass_kg() > 0)) continue;
    range.low_kg = std::min(range.low_kg, body.mass_kg());
    range.high_kg = std::max(range.high_kg, body.mass_kg());
  }
  return range;
}

std::vector<StabilityFinding> check_scene_coupling(const HapticScene& scene, const MassRange& tools,
                                                   const DeviceProfile& profile) {
  if (scene.law >= coupling_laws().size()) return {};
  const CouplingLawInfo& law = coupling_laws()[scene.law];
  const double slope_factor = steepest_slope_factor(law.name, scene.coupling);
  if (!(slope_factor > 0)) return {};
  const LoopDevice device = loop_device(profile, scene.workspace);
  const CouplingParameters parameters = rendered(scene.coupling, profile, device, slope_factor);
  std::vector<StabilityFinding> findings;
  for (const double mass_kg : {tools.low_kg, tools.high_kg}) {
    for (const StabilityFinding& finding :
         check_coupling(parameters, mass_kg, guessed_inertia(mass_kg), device, slope_factor)) {
      merge(finding, findings);
    }
    if (tools.low_kg == tools.high_kg) break;
  }
  return findings;
}

bool has_unstable(const std::vector<StabilityFinding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const StabilityFinding& finding) { return finding.verdict == StabilityVerdict::kUnstable; });
}

}  // namespace tandem

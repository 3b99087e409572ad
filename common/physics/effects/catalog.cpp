#include "common/physics/effects/catalog.hpp"

#include <array>

namespace tandem::physics {
namespace {

constexpr std::array<EffectInfo, 6> kCatalog{{
    {"viscosity", EffectEnergy::kDissipative, "f = -min(w b, m/h) v; torque alike", "Newtonian drag; bound: ours",
     "no stronger than what stops the tool within a step, of a massless tool unbounded; at rest not felt"},
    {"constant_field", EffectEnergy::kActive, "f = w f0", "weight on a slope",
     "in its fading edge it is not conservative: a tool taken round the edge gains energy each turn"},
    {"magnet", EffectEnergy::kConservative, "U = -U0 (1 - s^2)^3, s = distance/R, from the core; f = -grad U",
     "ours: the lowest power of 1 - s^2 whose force has no kink at R",
     "near a core with edges the force bends where the nearest point leaves a face"},
    {"vibration", EffectEnergy::kActive, "f = w A sin(2 pi F t) n; ringing: times exp(-t/T), t since entering",
     "Okamura, Cutkosky, Dennerlein, \"Reality-based models for vibration feedback in virtual environments\", 2001 "
     "(decaying sinusoid on contact)",
     "at most 400 Hz and 0.4 of the step rate; the amplitude does not follow the speed of impact"},
    {"texture", EffectEnergy::kActive, "U = N a sum sin(2 pi x/L); f = -w N grad a sum sin, along the surface",
     "Minsky et al., \"Feeling and seeing: issues in force display\", 1990 (force from the slope of the relief)",
     "conservative only while the normal force is constant; the normal force itself does not follow the bumps"},
    {"stick_slip", EffectEnergy::kDissipative,
     "f = -k (x - x_anchor) up to w F_b; there x_anchor jumps to where f is w F_s",
     "ours, after the materials of Salisbury, Brock, Massie, Swarup, Zilles, \"Haptic rendering: programming touch "
     "interaction with virtual objects\", 1995",
     "the breakaway force does not follow the normal force beyond full_contact_n"},
}};

static_assert(kCatalog.size() == std::variant_size_v<EffectModel>);

}  // namespace

std::span<const EffectInfo> effect_catalog() noexcept {
  return kCatalog;
}

const EffectInfo& effect_info(const EffectModel& model) noexcept {
  return kCatalog[model.index()];
}

std::string_view passivity_label(const EffectInfo& info) noexcept {
  return info.is_passive() ? "passive" : "active";
}

std::string listed_effect_names() {
  std::string names;
  for (const EffectInfo& info : kCatalog) names += (names.empty() ? "" : ", ") + std::string(info.name);
  return names;
}

}  // namespace tandem::physics

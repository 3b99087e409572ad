#include "common/haptics/coupling/laws.hpp"

#include <array>

#include "common/haptics/coupling/elastic_curves.hpp"

namespace tandem::haptics {
namespace {

template <class Law>
std::unique_ptr<CouplingLaw> make(const CouplingParameters& parameters) {
  if constexpr (std::is_constructible_v<Law, const CouplingParameters&>) {
    return std::make_unique<Law>(parameters);
  } else {
    return std::make_unique<Law>();
  }
}

constexpr std::array kLaws{
    CouplingLawInfo{kDefaultCouplingLaw, true, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-c (d/d_max)^2)) + b v, d_max = F_max/k, one curve both ways",
                    "Hou, PhD thesis, NTU, 2014, eqs. 4.1-4.8, made single-valued",
                    "a heavy tool sags more than on a linear spring; around zero only the damper holds",
                    &make<StableDynamic>},
    CouplingLawInfo{"spring-damper", true, ToolDynamics::kWithMass, "f = k d + b v",
                    "McNeely, Puterbaugh, Troy, SIGGRAPH 1999",
                    "one stiffness for light touch and firm grip; a light tool buzzes", &make<SpringDamper>},
    CouplingLawInfo{
        "adaptive", true, ToolDynamics::kWithMass, "f = k(m) d + b(k) v", "Hou, PhD thesis, NTU, 2014, eqs. 5.1-5.16",
        "needs a calibration of the device; outside its masses the nearest end counts", &make<AdaptiveSpringDamper>},
    CouplingLawInfo{"qsa-static", false, ToolDynamics::kMassless,
                    "f = F_max (1 - exp(-d/d_max)) + b v pushing, k d + b v receding",
                    "Wan, McNeely, IEEE Visualization 2003, as in Hou, PhD thesis, NTU, 2014, eqs. 3.10-3.14",
                    "no weight and no inertia to feel; a room sets b = 0 while the tool holds nothing; the force jumps "
                    "when the hand turns",
                    &make<QsaStatic>},
    CouplingLawInfo{"qsa-dynamic", false, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-d/d_max)) + b v pushing, k d + b v receding",
                    "Hou, PhD thesis, NTU, 2014, ch. 4: the curve of 3.10-3.14 on a tool with mass",
                    "a light tool buzzes; the force jumps when the hand turns", &make<QsaDynamic>},
    CouplingLawInfo{"stable-dynamic-literal", false, ToolDynamics::kWithMass,
                    "f = F_max (1 - exp(-c (d/d_max)^2)) + b v pushing, k d + b v receding",
                    "Hou, PhD thesis, NTU, 2014, eqs. 4.1-4.8, as printed",
                    "for comparison: gives back more than was put in; the force jumps when the hand turns or trembles",
                    &make<StableDynamicLiteral>},
    CouplingLawInfo{"direct", false, ToolDynamics::kAtHandle, "none: the hand is shown the contact force",
                    "Hou, PhD thesis, NTU, 2014, ch. 2: the baseline it argues against",
                    "for comparison: contact as stiff as it is, through one period of delay; no tool dynamics",
                    &make<DirectRendering>},
};

}  // namespace

RadialStiffness SpringDamper::elastic(const CouplingChannel& channel, double /*displacement*/,
                                      bool /*is_pushing*/) const noexcept {
  return linear_curve(channel.stiffness);
}

RadialStiffness QsaDynamic::elastic(const CouplingChannel& channel, double displacement,
                                    bool is_pushing) const noexcept {
  return is_pushing ? qsa_curve(channel.stiffness, channel.limit, displacement) : linear_curve(channel.stiffness);
}

RadialStiffness StableDynamic::elastic(const CouplingChannel& channel, double displacement,
                                       bool /*is_pushing*/) const noexcept {
  return stable_dynamic_curve(channel.stiffness, channel.limit, channel.sharpness, displacement);
}

RadialStiffness StableDynamicLiteral::elastic(const CouplingChannel& channel, double displacement,
                                              bool is_pushing) const noexcept {
  return is_pushing ? stable_dynamic_curve(channel.stiffness, channel.limit, channel.sharpness, displacement)
                    : linear_curve(channel.stiffness);
}

std::span<const CouplingLawInfo> coupling_laws() noexcept {
  return kLaws;
}

const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept {
  if (name.empty()) name = kDefaultCouplingLaw;
  for (const CouplingLawInfo& law : kLaws) {
    if (law.name == name) return &law;
  }
  return nullptr;
}

std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters) {
  const CouplingLawInfo* law = find_coupling_law(name);
  return law == nullptr ? nullptr : law->make(parameters);
}

std::string listed_coupling_law_names() {
  std::string text;
  for (const CouplingLawInfo& law : kLaws) text.append(text.empty() ? "" : ", ").append(law.name);
  return text;
}

}  // namespace tandem::haptics

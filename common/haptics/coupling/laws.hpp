// Every coupling law of the project: what each does, where it is from, and whether it can create energy.
//
//   law                     tool        elastic force along d, magnitude                          energy
//   spring-damper           with mass   k d                                                       passive
//   qsa-static              massless    k d_max (1 − e^(−d/d_max)) pushing, k d receding          active
//   qsa-dynamic             with mass   the same curve                                            active
//   stable-dynamic          with mass   F_max (1 − e^(−c (d/d_max)²)), one curve both ways        passive (default)
//   stable-dynamic-literal  with mass   the same pushing, k d receding                            active
//   adaptive                with mass   k(m) d, damping b(k): coupling/adaptive.hpp               passive
//   direct                  at handle   none: the contact force itself                            active
//
// All but direct add a damper, b (v_H − v_T), and saturate the whole force at F_max (saturation.hpp); rotation alike.
// "Passive": the elastic part is the gradient of a convex potential and the damper opposes motion (radial_law.hpp), so
// in continuous time nothing is created; sampled, see
// passivity/coupling_passivity_controller.hpp. "Active": it can create energy, and a test
// shows how much.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "common/haptics/coupling/coupling_law.hpp"
#include "common/haptics/coupling/radial_law.hpp"

namespace tandem::haptics {

/// What a user should know of a law before choosing it.
struct CouplingLawInfo {
  std::string_view name;
  bool is_passive = false;
  ToolDynamics tool = ToolDynamics::kWithMass;
  std::string_view model;  ///< one line, letters as in CouplingParameters; rotation alike
  std::string_view source;
  std::string_view limits;  ///< what it is not good at
  std::unique_ptr<CouplingLaw> (*make)(const CouplingParameters& parameters) = nullptr;
};

inline constexpr std::string_view kDefaultCouplingLaw = "stable-dynamic";

/// All laws, the default first.
std::span<const CouplingLawInfo> coupling_laws() noexcept;
/// Null when there is none of that name; "" means the default.
const CouplingLawInfo* find_coupling_law(std::string_view name) noexcept;
/// Null when there is none of that name; "" means the default.
std::unique_ptr<CouplingLaw> make_coupling_law(std::string_view name, const CouplingParameters& parameters);
/// "stable-dynamic, spring-damper, …": for messages.
std::string listed_coupling_law_names();

/// Linear spring and damper.
///
/// Model   f = k_t d + b_t v;  τ = k_r θ + b_r ω; saturated
/// Source  McNeely, Puterbaugh, Troy, "Six degree-of-freedom haptic rendering using voxel sampling", SIGGRAPH 1999
class SpringDamper : public RadialLaw {
 public:
  explicit SpringDamper(const CouplingParameters& parameters) noexcept : RadialLaw(parameters) {}
  std::string_view name() const noexcept override { return "spring-damper"; }

 private:
  RadialStiffness elastic(const CouplingChannel& channel, double displacement, bool is_pushing) const noexcept override;
};

/// A spring and damper whose coefficients fit the tool's mass: the caller takes its parameters through adapted()
/// (adaptive.hpp), the law itself knows no mass. A name of its own, so that a scene can ask for it.
///
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 5.1–5.16
class AdaptiveSpringDamper final : public SpringDamper {
 public:
  using SpringDamper::SpringDamper;
  std::string_view name() const noexcept override { return "adaptive"; }
};

/// The curve of the quasi-static approximation while the handle is pushed away from the tool, a linear spring while it
/// comes back (so that a surface does not hold it): the force jumps where it turns, and the way back gives more than
/// the way there took.
///
/// Model   qsa_curve() pushing, k d receding; damper; saturated. The softness acts on this too: e reaches L, the force
///         shown L (1 − ε/e), 0.926 L at ε 0.2
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 3.10–3.14; after Wan, McNeely 2003. The damper is the thesis's, who puts
///         the curve on a tool with mass
class QsaDynamic : public RadialLaw {
 public:
  explicit QsaDynamic(const CouplingParameters& parameters) noexcept : RadialLaw(parameters) {}
  std::string_view name() const noexcept override { return "qsa-dynamic"; }

 private:
  RadialStiffness elastic(const CouplingChannel& channel, double displacement, bool is_pushing) const noexcept override;
};

/// QsaDynamic as it was first described: the tool has no mass and rests, each step, where coupling and contact balance.
class QsaStatic final : public QsaDynamic {
 public:
  using QsaDynamic::QsaDynamic;
  std::string_view name() const noexcept override { return "qsa-static"; }
  ToolDynamics tool_dynamics() const noexcept override { return ToolDynamics::kMassless; }
};

/// One curve there and back: flat around zero, then steep, then tired at the limit.
///
/// Model   stable_dynamic_curve(); damper; saturated. The softness acts on this too: e reaches L, the force shown
///         L (1 − ε/e), 0.926 L at ε 0.2; the damper has what is left up to L
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 4.1–4.8. Theirs goes back along k d (StableDynamicLiteral), which gives
///         out energy; ours takes the one curve both ways and is passive
class StableDynamic final : public RadialLaw {
 public:
  explicit StableDynamic(const CouplingParameters& parameters) noexcept : RadialLaw(parameters) {}
  std::string_view name() const noexcept override { return "stable-dynamic"; }

 private:
  RadialStiffness elastic(const CouplingChannel& channel, double displacement, bool is_pushing) const noexcept override;
};

/// The stable dynamic law as printed, for comparison: its curve while pushing, a linear spring while receding.
///
/// Source  Hou, PhD thesis, NTU, 2014, eqs. 4.4, 4.5
class StableDynamicLiteral final : public RadialLaw {
 public:
  explicit StableDynamicLiteral(const CouplingParameters& parameters) noexcept : RadialLaw(parameters) {}
  std::string_view name() const noexcept override { return "stable-dynamic-literal"; }

 private:
  RadialStiffness elastic(const CouplingChannel& channel, double displacement, bool is_pushing) const noexcept override;
};

/// No coupling: the tool is where the handle is, the hand is shown the contact itself. Whoever shows that wrench
/// saturates it, with the same limits and softness.
///
/// Source  what Hou, PhD thesis, NTU, 2014, ch. 2, calls direct rendering and argues against: the baseline
class DirectRendering final : public CouplingLaw {
 public:
  std::string_view name() const noexcept override { return "direct"; }
  void set_parameters(const CouplingParameters& /*parameters*/) noexcept override {}
  Wrench wrench_on_tool_W(const CouplingState& /*state*/) const noexcept override { return {}; }
  CouplingGradient gradient(const CouplingState& /*state*/) const noexcept override { return {}; }
  ToolDynamics tool_dynamics() const noexcept override { return ToolDynamics::kAtHandle; }
};

}  // namespace tandem::haptics

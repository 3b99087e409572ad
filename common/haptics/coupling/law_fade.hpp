// Cross-fade between two coupling laws, so that a change under a stretched coupling makes no step of force. Server and
// client use the same fade, as they use the same ramp of coefficients (coupling_ramp.hpp).
#pragma once

#include <memory>
#include <vector>

#include "common/haptics/coupling/coupling_ramp.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {

/// Duration of a change of law. Ours: two forces that differ by 18 N change by 0.06 N in a millisecond.
inline constexpr double kLawFade_s = 0.3;

/// Coupling whose law and coefficients follow a target. A change of coefficients alone uses CouplingRamp.
///
/// Model   f = (1 − s) f_old + s f_new, s = min(1, t / 300 ms). The old law keeps its coefficients, the new one has its
///         own from the start. Each is bounded for its own curve, so the mixture is nowhere steeper than the steeper
///         and nowhere stronger than the stronger of the two. Its gradient is the same mixture of both gradients,
///         without a negative eigenvalue. The change of the stored energy comes from the change of the law, as with
///         CouplingRamp. A law requested during a fade starts to fade in when that fade ends
/// Source  our derivation
/// Thread  haptic and room: no allocation, no throw after construction
class LawFade final : private CouplingLaw {
 public:
  LawFade(const CouplingLawInfo& law, const CouplingParameters& parameters);

  /// Starts a change. Without effect for a law that cannot replace the target law (are_exchangeable()).
  void fade_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void jump_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void advance(double step_s) noexcept;

  /// Law in force now; valid until the next call that changes this object.
  const CouplingLaw& law() const noexcept { return share_ < 1 ? static_cast<const CouplingLaw&>(*this) : *to_; }
  /// Coefficients in force now, with the same validity. During a fade they ramp from the old law's to the new law's.
  const CouplingParameters& parameters() const noexcept { return shown_.now(); }
  /// Law at the end of the change.
  const CouplingLawInfo& target_law() const noexcept { return *wanted_; }
  const CouplingParameters& target() const noexcept { return shown_.target(); }

 private:
  std::string_view name() const noexcept override { return to_->name(); }
  void set_parameters(const CouplingParameters& parameters) noexcept override { to_->set_parameters(parameters); }
  Wrench wrench_on_tool_W(const CouplingState& state) const noexcept override;
  CouplingGradient gradient(const CouplingState& state) const noexcept override;
  ToolDynamics tool_dynamics() const noexcept override { return to_->tool_dynamics(); }

  CouplingLaw* made(const CouplingLawInfo& law) const noexcept;
  void begin() noexcept;

  std::vector<std::unique_ptr<CouplingLaw>> laws_;  ///< parallel to coupling_laws()
  const CouplingLawInfo* wanted_;
  const CouplingLawInfo* current_;  ///< law of to_
  CouplingLaw* from_;
  CouplingLaw* to_;
  double share_ = 1;    ///< share of to_ in the mixture
  CouplingRamp ramp_;   ///< coefficients of to_
  CouplingRamp shown_;  ///< result of parameters()
};

}  // namespace tandem::haptics

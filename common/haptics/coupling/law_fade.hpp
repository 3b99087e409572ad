// A law that changes under a stretched coupling must not make a step of the force: the old one fades into the new. Server
// and client use the same fade, as they use the same ramp of coefficients (coupling_ramp.hpp).
#pragma once

#include <memory>
#include <vector>

#include "common/haptics/coupling/coupling_ramp.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {

/// How long a change of the law takes. Ours: two forces that differ by 18 N go over by 0.06 N in a millisecond.
inline constexpr double kLawFade_s = 0.3;

/// A coupling whose law and coefficients follow what is asked for. Coefficients alone go by CouplingRamp.
///
/// Model   f = (1 − s) f_old + s f_new, s = min(1, t / 300 ms). The old law keeps the coefficients that it had, the new has
///         its own from the start: each is bounded for its own curve, so the mixture is nowhere steeper than the steeper of
///         the two, and nowhere stronger than the stronger. Its gradient is the same mixture of both, without a negative
///         eigenvalue. What the stored energy changes by comes from the change itself, as with CouplingRamp. A change that
///         is asked for while one is under way begins at its end
/// Source  our derivation
/// Thread  haptic and room: no allocation, no throw after construction
class LawFade final : private CouplingLaw {
 public:
  LawFade(const CouplingLawInfo& law, const CouplingParameters& parameters);

  /// Nothing changes when the law is another one and cannot take the place of the one before (law_change_problem()).
  void go_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void jump_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void advance(double step_s) noexcept;

  /// In force now; valid until the next call that changes this.
  const CouplingLaw& law() const noexcept { return share_ < 1 ? static_cast<const CouplingLaw&>(*this) : *to_; }
  /// Likewise. While a law fades, what goes from the coefficients of the old to those of the new.
  const CouplingParameters& parameters() const noexcept { return shown_.now(); }
  /// Where it is going.
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
  const CouplingLawInfo* current_;  ///< what to_ is
  CouplingLaw* from_;
  CouplingLaw* to_;
  double share_ = 1;    ///< of to_
  CouplingRamp ramp_;   ///< of to_
  CouplingRamp shown_;  ///< parameters()
};

}  // namespace tandem::haptics

// Cross-fade between two coupling laws, so that a change while the coupling is stretched causes no step of force.
// Server and client use the same fade, and the same ramp of coefficients (coupling_ramp.hpp).
#pragma once

#include <memory>
#include <vector>

#include "common/haptics/coupling/coupling_ramp.hpp"
#include "common/haptics/coupling/laws.hpp"

namespace tandem::haptics {

/// Duration of a change of law. With this duration, the force changes by only 0.06 N/ms even if the forces of the two
/// laws differ by 18 N.
inline constexpr double kLawFade_s = 0.3;

/// Coupling whose law and coefficients change gradually to a target. If only coefficients change, it uses CouplingRamp
/// instead of the cross-fade.
///
/// Model   f = (1 − s) f_old + s f_new, s = min(1, t / 300 ms). The old law keeps its coefficients; the new law has its
///         target coefficients from the start.
///         * Bounds: each law bounds its own force. The mixture is therefore never steeper than the steeper law, and
///           never stronger than the stronger one. The gradient is mixed in the same way and has no negative
///           eigenvalue.
///         * Energy: the change itself adds or removes stored energy, as with CouplingRamp.
///         * Queue: a law that is requested during a fade is faded in when the current fade ends
/// Source  our derivation
/// Thread  haptic and room: no allocation, no throw after construction
class LawFade final : private CouplingLaw {
 public:
  LawFade(const CouplingLawInfo& law, const CouplingParameters& parameters);

  /// Starts a change of law and coefficients. Has no effect if `law` cannot replace the target law
  /// (are_exchangeable()).
  void fade_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void jump_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept;
  void advance(double step_s) noexcept;

  /// Current law, or the mixture during a fade. The reference is valid until the next call that changes this object.
  const CouplingLaw& law() const noexcept { return share_ < 1 ? static_cast<const CouplingLaw&>(*this) : *to_; }
  /// Current coefficients, valid as long as law(). During a fade they change linearly from the old law's to the new
  /// law's.
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

  std::vector<std::unique_ptr<CouplingLaw>> laws_;  ///< one instance of each law, in the order of coupling_laws()
  const CouplingLawInfo* wanted_;
  const CouplingLawInfo* current_;  ///< law of to_
  CouplingLaw* from_;
  CouplingLaw* to_;
  double share_ = 1;    ///< weight of to_ in the mixture
  CouplingRamp ramp_;   ///< coefficients of to_
  CouplingRamp shown_;  ///< coefficients returned by parameters()
};

}  // namespace tandem::haptics

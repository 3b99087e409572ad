// The coupling that a hand is shown: the law that the scene asks for, with coefficients that this device bears.
#pragma once

#include "client/haptics/mailboxes.hpp"
#include "common/haptics/coupling/law_fade.hpp"

namespace tandem::client {

/// Coefficients that change are ramped and a law that changes fades, as at the server, so that a change under a
/// stretched coupling is felt as no step.
///
/// Thread  haptic: no allocation, no throw after construction
class SceneCoupling {
 public:
  explicit SceneCoupling(const haptics::CouplingParameters& device_bounds);

  /// Law and coefficients exist and are in range.
  static bool is_usable(const HapticScene& scene) noexcept;
  /// Starts towards law and coefficients of a usable scene, as bounded by the device (rendered_coupling()).
  void go_to(const HapticScene& scene) noexcept;
  /// Takes a usable scene's law and coefficients at once.
  void start(const HapticScene& scene) noexcept;
  /// Ends ramp and fade.
  void jump() noexcept;
  /// By a tick; after a stall too by no more than one (HapticCore).
  void advance(double period_s) noexcept;

  const haptics::CouplingLaw& law() const noexcept { return fade_.law(); }
  /// In force in law().
  const haptics::CouplingParameters& parameters() const noexcept { return fade_.parameters(); }
  const haptics::CouplingParameters& device_bounds() const noexcept { return device_bounds_; }

 private:
  haptics::CouplingParameters rendered(const HapticScene& scene) const noexcept;

  haptics::CouplingParameters device_bounds_;
  haptics::LawFade fade_{haptics::coupling_laws().front(), haptics::CouplingParameters{}};
};

}  // namespace tandem::client

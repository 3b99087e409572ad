// The coupling displayed to the hand: the scene's law, with coefficients bounded by this device.
#pragma once

#include "client/exchange/mailboxes.hpp"
#include "common/haptics/coupling/law_fade.hpp"

namespace tandem::client {

/// Ramps changed coefficients and fades a changed law, as the server does, so that a change under a stretched coupling
/// causes no force step.
///
/// Thread  haptic: no allocation, no throw after construction
class SceneCoupling {
 public:
  explicit SceneCoupling(const haptics::CouplingParameters& device_bounds);

  /// True if the law exists and the coefficients are in range.
  static bool is_usable(const HapticScene& scene) noexcept;
  /// Ramps towards law and coefficients of a usable scene, bounded by the device (rendered_coupling()).
  void fade_to(const HapticScene& scene) noexcept;
  /// Sets a usable scene's law and coefficients at once.
  void start(const HapticScene& scene) noexcept;
  /// Ends ramp and fade at their targets.
  void jump() noexcept;
  /// Advances ramp and fade by one period; HapticCore clamps it after a stall.
  void advance(double period_s) noexcept;

  const haptics::CouplingLaw& law() const noexcept { return fade_.law(); }
  /// Current coefficients of law().
  const haptics::CouplingParameters& parameters() const noexcept { return fade_.parameters(); }
  const haptics::CouplingParameters& device_bounds() const noexcept { return device_bounds_; }

 private:
  haptics::CouplingParameters rendered(const HapticScene& scene) const noexcept;

  haptics::CouplingParameters device_bounds_;
  haptics::LawFade fade_{haptics::coupling_laws().front(), haptics::CouplingParameters{}};
};

}  // namespace tandem::client

// The coupling that is displayed to the hand: the scene's law with coefficients bounded for this device.
#pragma once

#include "client/exchange/mailboxes.hpp"
#include "common/haptics/coupling/law_fade.hpp"

namespace tandem::client {

/// Ramps changed coefficients and fades a changed law, by the same code as at the server. So a change causes no force
/// step, even if the spring between handle and tool is stretched.
///
/// Thread  haptic: no allocation, no throw after construction
class SceneCoupling {
 public:
  explicit SceneCoupling(const haptics::CouplingParameters& device_bounds);

  /// Returns true if the law exists and the coefficients are in range.
  static bool is_usable(const HapticScene& scene) noexcept;
  /// Starts the ramp towards the law and coefficients of a usable scene, bounded for the device (rendered_coupling()).
  void fade_to(const HapticScene& scene) noexcept;
  /// Sets the law and coefficients of a usable scene without a ramp.
  void start(const HapticScene& scene) noexcept;
  /// Moves ramp and fade to their targets at once.
  void jump() noexcept;
  /// Advances ramp and fade by one period.
  void advance(double period_s) noexcept;

  const haptics::CouplingLaw& law() const noexcept { return fade_.law(); }
  /// Returns the current coefficients of law().
  const haptics::CouplingParameters& parameters() const noexcept { return fade_.parameters(); }
  const haptics::CouplingParameters& device_bounds() const noexcept { return device_bounds_; }

 private:
  haptics::CouplingParameters rendered(const HapticScene& scene) const noexcept;

  haptics::CouplingParameters device_bounds_;
  haptics::LawFade fade_{haptics::coupling_laws().front(), haptics::CouplingParameters{}};
};

}  // namespace tandem::client

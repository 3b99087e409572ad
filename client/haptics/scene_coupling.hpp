// The coupling that a hand is shown: the law that the scene asks for, with coefficients that this device bears.
#pragma once

#include <memory>
#include <vector>

#include "client/haptics/mailboxes.hpp"
#include "common/haptics/coupling/coupling_ramp.hpp"

namespace tandem::client {

/// Every law is made beforehand; coefficients that change are ramped, as the server ramps them, so that a change under
/// a stretched coupling is felt as no step.
///
/// Thread  haptic: no allocation, no throw after construction
class SceneCoupling {
 public:
  explicit SceneCoupling(const haptics::CouplingParameters& device_bounds);

  /// Law and coefficients exist and are in range.
  static bool is_usable(const HapticScene& scene) noexcept;
  /// Starts towards the coefficients of a usable scene, as bounded by the device (rendered_coupling()).
  void go_to(const HapticScene& scene) noexcept;
  /// Takes a usable scene's law and coefficients at once.
  void start(const HapticScene& scene) noexcept;
  /// Ends the ramp.
  void jump() noexcept;
  void advance(LocalTime now) noexcept;

  const haptics::CouplingLaw& law() const noexcept { return *law_; }
  /// In force in law().
  const haptics::CouplingParameters& parameters() const noexcept { return ramp_.now(); }
  const haptics::CouplingParameters& device_bounds() const noexcept { return device_bounds_; }

 private:
  haptics::CouplingParameters device_bounds_;
  std::vector<std::unique_ptr<haptics::CouplingLaw>> laws_;  ///< parallel to coupling_laws()
  haptics::CouplingLaw* law_;                                ///< one of them
  haptics::CouplingRamp ramp_{haptics::CouplingParameters{}};
  LocalTime advanced_at_{};
};

}  // namespace tandem::client

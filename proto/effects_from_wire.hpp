// Effects of a complete scene, as the world uses them. Server and client both need it, and neither may use the other.
#pragma once

#include <type_traits>
#include <vector>

#include "common/physics/effects/effect_settings.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// Calls `visit(name, model)` with the model that the effect has. False: it has none.
template <typename Effect, typename Visit>
bool visit_model(Effect& effect, const Visit& visit) {
  const auto part = [&effect]([[maybe_unused]] auto constant, [[maybe_unused]] auto variable) -> decltype(auto) {
    if constexpr (std::is_const_v<Effect>) {
      return (effect.*constant)();
    } else {
      return *(effect.*variable)();
    }
  };
  using E = wire::Effect;
  switch (effect.kind_case()) {
    case E::kViscosity:
      visit("viscosity", part(&E::viscosity, &E::mutable_viscosity));
      return true;
    case E::kConstantField:
      visit("constant_field", part(&E::constant_field, &E::mutable_constant_field));
      return true;
    case E::kMagnet:
      visit("magnet", part(&E::magnet, &E::mutable_magnet));
      return true;
    case E::kVibration:
      visit("vibration", part(&E::vibration, &E::mutable_vibration));
      return true;
    case E::kTexture:
      visit("texture", part(&E::texture, &E::mutable_texture));
      return true;
    case E::kStickSlip:
      visit("stick_slip", part(&E::stick_slip, &E::mutable_stick_slip));
      return true;
    case E::KIND_NOT_SET:
      break;
  }
  return false;
}

/// Numbers that are absent count as 0; find_problem() (common/physics/effects) says what cannot be.
physics::EffectSettings settings_of(const wire::Effect& effect);

/// Those of the bodies first, all in the order of the scene.
/// In      scene  complete
std::vector<physics::EffectSettings> effects_of(const wire::Scene& scene);

}  // namespace tandem::proto

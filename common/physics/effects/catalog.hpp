// Every kind of effect: what it does, where it is from, and whether it can give out energy.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/physics/effects/effect_settings.hpp"

namespace tandem::physics {

/// What an effect does to the energy of a tool and its owner together.
enum class EffectEnergy : std::uint8_t {
  kDissipative,   ///< takes out, never gives
  kConservative,  ///< gives back on the way out what it took on the way in, or the other way round: nothing on a closed
                  ///< path
  kActive,        ///< can give out without end
};

/// What an author should know of an effect before using it.
struct EffectInfo {
  std::string_view name;  ///< as in scene files
  EffectEnergy energy = EffectEnergy::kActive;
  std::string_view model;  ///< one line; letters as in README.md
  std::string_view source;
  std::string_view limits;  ///< what it is not good at

  /// Over any closed path of the tool nothing is given out.
  bool is_passive() const { return energy != EffectEnergy::kActive; }
};

/// All effects, in the order of EffectModel.
std::span<const EffectInfo> effect_catalog() noexcept;
const EffectInfo& effect_info(const EffectModel& model) noexcept;
/// "passive" or "active".
std::string_view passivity_label(const EffectInfo& info) noexcept;
/// "viscosity, constant_field, …": for messages.
std::string listed_effect_names();

}  // namespace tandem::physics

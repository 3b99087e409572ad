// Table of the coefficients of the coupling, with their names and the ranges accepted in messages. The server checks
// SetParameter messages by this table; a client checks the values that it receives.
#pragma once

#include <array>
#include <cmath>
#include <string_view>

#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/haptics/coupling/rendered_coupling.hpp"
#include "tandem/scene.pb.h"

namespace tandem::proto {

/// A coefficient: its name, its range, and the members that hold it in the C++ struct and in the message.
struct CouplingField {
  std::string_view name;  ///< name in SetParameter and ParameterSet
  double haptics::CouplingParameters::*value;
  double low;
  double high;
  double (wire::Coupling::*get)() const;
  void (wire::Coupling::*set)(double);
  bool (wire::Coupling::*has)() const;

  bool accepts(double number) const { return std::isfinite(number) && number >= low && number <= high; }
};

/// Name of the parameter that selects the coupling law (in SetParameter and ParameterSet). Its value is a text.
inline constexpr std::string_view kLawParameter = "coupling.law";

/// All coefficients, in the order of kCouplingRanges.
inline constexpr std::array<CouplingField, haptics::kCouplingRanges.size()> kCouplingFields{{
    {"coupling.stiffness_n_per_m", &haptics::CouplingParameters::stiffness_n_per_m, haptics::kCouplingRanges[0].low,
     haptics::kCouplingRanges[0].high, &wire::Coupling::stiffness_n_per_m, &wire::Coupling::set_stiffness_n_per_m,
     &wire::Coupling::has_stiffness_n_per_m},
    {"coupling.damping_n_s_per_m", &haptics::CouplingParameters::damping_n_s_per_m, haptics::kCouplingRanges[1].low,
     haptics::kCouplingRanges[1].high, &wire::Coupling::damping_n_s_per_m, &wire::Coupling::set_damping_n_s_per_m,
     &wire::Coupling::has_damping_n_s_per_m},
    {"coupling.stiffness_n_m_per_rad", &haptics::CouplingParameters::stiffness_n_m_per_rad,
     haptics::kCouplingRanges[2].low, haptics::kCouplingRanges[2].high, &wire::Coupling::stiffness_n_m_per_rad,
     &wire::Coupling::set_stiffness_n_m_per_rad, &wire::Coupling::has_stiffness_n_m_per_rad},
    {"coupling.damping_n_m_s_per_rad", &haptics::CouplingParameters::damping_n_m_s_per_rad,
     haptics::kCouplingRanges[3].low, haptics::kCouplingRanges[3].high, &wire::Coupling::damping_n_m_s_per_rad,
     &wire::Coupling::set_damping_n_m_s_per_rad, &wire::Coupling::has_damping_n_m_s_per_rad},
    {"coupling.force_limit_n", &haptics::CouplingParameters::force_limit_n, haptics::kCouplingRanges[4].low,
     haptics::kCouplingRanges[4].high, &wire::Coupling::force_limit_n, &wire::Coupling::set_force_limit_n,
     &wire::Coupling::has_force_limit_n},
    {"coupling.torque_limit_n_m", &haptics::CouplingParameters::torque_limit_n_m, haptics::kCouplingRanges[5].low,
     haptics::kCouplingRanges[5].high, &wire::Coupling::torque_limit_n_m, &wire::Coupling::set_torque_limit_n_m,
     &wire::Coupling::has_torque_limit_n_m},
    {"coupling.saturation_softness", &haptics::CouplingParameters::saturation_softness, haptics::kCouplingRanges[6].low,
     haptics::kCouplingRanges[6].high, &wire::Coupling::saturation_softness, &wire::Coupling::set_saturation_softness,
     &wire::Coupling::has_saturation_softness},
    {"coupling.curve_sharpness", &haptics::CouplingParameters::curve_sharpness, haptics::kCouplingRanges[7].low,
     haptics::kCouplingRanges[7].high, &wire::Coupling::curve_sharpness, &wire::Coupling::set_curve_sharpness,
     &wire::Coupling::has_curve_sharpness},
}};

/// Returns the coefficient with this name; null if there is none.
constexpr const CouplingField* find_coupling_field(std::string_view name) {
  for (const CouplingField& field : kCouplingFields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

/// Writes the coupling bounds of a device. An infinite value means that there is no bound, and is omitted.
inline void write_bounds(const haptics::CouplingParameters& bounds, wire::Coupling& out) {
  for (const CouplingField& field : kCouplingFields) {
    if (std::isfinite(bounds.*field.value)) (out.*field.set)(bounds.*field.value);
  }
}
/// Reads the coupling bounds of a device. The values are not checked: the caller must do so, because a peer may send
/// any.
inline haptics::CouplingParameters read_bounds(const wire::Coupling& coupling) {
  haptics::CouplingParameters bounds = haptics::kNoCouplingBounds;
  for (const CouplingField& field : kCouplingFields) {
    if ((coupling.*field.has)()) bounds.*field.value = (coupling.*field.get)();
  }
  return bounds;
}

}  // namespace tandem::proto

// The coupling's coefficients by name, with the range that is accepted from the wire. The server checks
// SetParameter against it, the client checks what the server says.
#pragma once

#include <array>
#include <cmath>
#include <string_view>

#include "common/coupling/coupling_law.hpp"
#include "tandem/scene.pb.h"

namespace tandem {

/// One coefficient. The ranges keep arithmetic sane (a hand is protected by its own device's limits, never by
/// these): wide enough for scenes from nanometres to rooms after workspace scaling.
struct CouplingField {
  std::string_view name;  ///< as in SetParameter and ParameterSet
  double CouplingParameters::*value;
  double low;
  double high;
  double (wire::Coupling::*get)() const;
  void (wire::Coupling::*set)(double);
  bool (wire::Coupling::*has)() const;

  bool accepts(double number) const { return std::isfinite(number) && number >= low && number <= high; }
};

inline constexpr std::array<CouplingField, 8> kCouplingFields{{
    {"coupling.stiffness_n_per_m", &CouplingParameters::stiffness_n_per_m, 0, 1e5, &wire::Coupling::stiffness_n_per_m,
     &wire::Coupling::set_stiffness_n_per_m, &wire::Coupling::has_stiffness_n_per_m},
    {"coupling.damping_n_s_per_m", &CouplingParameters::damping_n_s_per_m, 0, 1e4, &wire::Coupling::damping_n_s_per_m,
     &wire::Coupling::set_damping_n_s_per_m, &wire::Coupling::has_damping_n_s_per_m},
    {"coupling.stiffness_n_m_per_rad", &CouplingParameters::stiffness_n_m_per_rad, 0, 1e4,
     &wire::Coupling::stiffness_n_m_per_rad, &wire::Coupling::set_stiffness_n_m_per_rad,
     &wire::Coupling::has_stiffness_n_m_per_rad},
    {"coupling.damping_n_m_s_per_rad", &CouplingParameters::damping_n_m_s_per_rad, 0, 1e3,
     &wire::Coupling::damping_n_m_s_per_rad, &wire::Coupling::set_damping_n_m_s_per_rad,
     &wire::Coupling::has_damping_n_m_s_per_rad},
    {"coupling.force_limit_n", &CouplingParameters::force_limit_n, 1e-3, 1e3, &wire::Coupling::force_limit_n,
     &wire::Coupling::set_force_limit_n, &wire::Coupling::has_force_limit_n},
    {"coupling.torque_limit_n_m", &CouplingParameters::torque_limit_n_m, 1e-3, 1e3, &wire::Coupling::torque_limit_n_m,
     &wire::Coupling::set_torque_limit_n_m, &wire::Coupling::has_torque_limit_n_m},
    {"coupling.saturation_softness", &CouplingParameters::saturation_softness, 0, 1,
     &wire::Coupling::saturation_softness, &wire::Coupling::set_saturation_softness,
     &wire::Coupling::has_saturation_softness},
    {"coupling.curve_sharpness", &CouplingParameters::curve_sharpness, 0.1, 10, &wire::Coupling::curve_sharpness,
     &wire::Coupling::set_curve_sharpness, &wire::Coupling::has_curve_sharpness},
}};

/// Whether arithmetic with these coefficients is sound; their ranges are for what comes from outside.
inline bool is_usable(const CouplingParameters& parameters) {
  for (const CouplingField& field : kCouplingFields) {
    const double value = parameters.*field.value;
    if (!std::isfinite(value) || value < 0) return false;
  }
  return true;
}

/// Null for an unknown name.
constexpr const CouplingField* find_coupling_field(std::string_view name) {
  for (const CouplingField& field : kCouplingFields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

}  // namespace tandem

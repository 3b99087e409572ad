// The coupling's coefficients by name, with the range that is accepted from the wire. The server checks
// SetParameter against it, the client checks what the server says.
#pragma once

#include <array>
#include <cmath>
#include <string_view>

#include "common/coupling.hpp"
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

inline constexpr std::array<CouplingField, 6> kCouplingFields{{
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
}};

/// Null for an unknown name.
constexpr const CouplingField* find_coupling_field(std::string_view name) {
  for (const CouplingField& field : kCouplingFields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

}  // namespace tandem

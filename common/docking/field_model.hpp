// Settings of the molecular field and its result, shared by the exact field and the float kernels.
#pragma once

#include <string>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// Coulomb constant, k = e²·N_A/(4π ε_0).
/// Source  GROMACS 2022 reference manual, "Definitions and units": 138.935458 kJ·nm/mol/e²
inline constexpr double kCoulombKjAngstromPerMol = 1389.35458;
/// Below this distance the Coulomb energy continues as its tangent parabola, because a hydrogen without a Lennard-Jones
/// term may reach the atom that attracts it.
inline constexpr double kChargeCoreAngstrom = 0.8;
/// Width below the cut-off over which forces are switched off.
inline constexpr double kSwitchWidthAngstrom = 2;
inline constexpr double kMinCutoffAngstrom = 4;
inline constexpr double kMaxCutoffAngstrom = 100;

enum class Dielectric {
  kNone,      ///< no Coulomb term
  kConstant,  ///< ε
  kDistance,  ///< ε = permittivity · r/Å
};

struct FieldModel {
  Dielectric dielectric = Dielectric::kNone;
  double permittivity = 4;     ///< relative: ε, or ε at 1 Å
  double cutoff_angstrom = 0;  ///< no force beyond; 0: all pairs
  bool has_far_grid = false;   ///< the part beyond the cut-off from a grid (far_grid.hpp); exact_field() sums all pairs

  bool operator==(const FieldModel&) const = default;
};

/// Sets the charge term: "none", a constant such as "1", or a factor of the distance such as "4r".
/// Fails   std::invalid_argument naming the text, for any other
void set_dielectric(FieldModel& model, const std::string& text);

/// Checks the settings.
/// Fails   std::invalid_argument naming field, value and range: permittivity 0.1 … 1000, cut-off 0 or 4 … 100 Å
void validate(const FieldModel& model);

/// Energy, and force and torque on molecule B in A's frame; the force on A is opposite.
struct FieldResult {
  double lennard_jones_kj_per_mol = 0;
  double coulomb_kj_per_mol = 0;
  Vec3 force_on_b = Vec3::Zero();   ///< kJ/mol/Å
  Vec3 torque_on_b = Vec3::Zero();  ///< kJ/mol, about the origin of B's frame

  double energy_kj_per_mol() const { return lennard_jones_kj_per_mol + coulomb_kj_per_mol; }
};

/// Force switch of an energy r^−α: the force α r^−(α+1) + A x² + B x³ with x = max(r − r_1, 0) ends at the cut-off r_c
/// with value and slope zero; the energy r^−α − A x³/3 − B x⁴/4 − C is its integral and zero there.
/// Source  GROMACS 2022 reference manual, "Modified non-bonded interactions", equations for F_s and Φ_s
struct ForceSwitch {
  double a = 0;
  double b = 0;
  double c = 0;
};
ForceSwitch force_switch(double alpha, double start_angstrom, double cutoff_angstrom);

}  // namespace tandem::docking

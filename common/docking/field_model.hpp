// Settings of the molecular field and its result, used by the exact field and by the float kernels.
#pragma once

#include <string>

#include "common/base/spatial.hpp"

namespace tandem::docking {

/// Coulomb constant, k = e²·N_A/(4π ε_0).
/// Source  GROMACS 2022 reference manual, "Definitions and units": 138.935458 kJ·nm/mol/e²
inline constexpr double kCoulombKjAngstromPerMol = 1389.35458;
/// Distance below which the Coulomb energy is continued as its tangent parabola in r (the core). Some hydrogens have a
/// charge but no Lennard-Jones term. Without the core, nothing would stop such a hydrogen on its way to the centre of
/// an atom that attracts it.
inline constexpr double kChargeCoreAngstrom = 0.8;
/// Width of the range below the cut-off in which forces are switched off.
inline constexpr double kSwitchWidthAngstrom = 2;
inline constexpr double kMinCutoffAngstrom = 4;
inline constexpr double kMaxCutoffAngstrom = 100;

enum class Dielectric {
  kNone,      ///< no charges: no Coulomb term
  kConstant,  ///< relative permittivity is the constant ε
  kDistance,  ///< relative permittivity grows with the distance r: ε = permittivity · r/Å
};

struct FieldModel {
  Dielectric dielectric = Dielectric::kNone;
  double permittivity = 4;     ///< relative permittivity: ε, or ε at 1 Å for kDistance
  double cutoff_angstrom = 0;  ///< distance beyond which the force is zero; 0: no cut-off
  bool has_far_grid = false;   ///< whether a grid adds the part beyond the cut-off (far_grid.hpp)

  bool operator==(const FieldModel&) const = default;
};

/// Sets the charge term from a text: "none", a constant ε such as "1", or a multiple of the distance such as "4r".
/// Fails   throws std::invalid_argument that quotes any other text
void set_dielectric(FieldModel& model, const std::string& text);

/// Checks the permittivity and the cut-off, and that a model with a far grid has a cut-off.
/// Fails   throws std::invalid_argument naming field, value and range: permittivity 0.1 … 1000, cut-off 0 or 4 … 100 Å
void validate(const FieldModel& model);

/// Energy, and force and torque on molecule B in A's frame. The force on A is the opposite.
struct FieldResult {
  double lennard_jones_kj_per_mol = 0;
  double coulomb_kj_per_mol = 0;
  Vec3 force_on_b = Vec3::Zero();   ///< force on B [kJ/mol/Å]
  Vec3 torque_on_b = Vec3::Zero();  ///< torque on B about the origin of B's frame [kJ/mol]

  double energy_kj_per_mol() const { return lennard_jones_kj_per_mol + coulomb_kj_per_mol; }
};

/// Force switch of an energy r^−α, which makes force and energy zero at the cut-off r_c. The force is α r^−(α+1) + A x²
/// + B x³ with x = max(r − r_1, 0), where r_1 is the start of the switch. A and B are chosen such that the force and
/// its slope are zero at r_c. The energy is the integral of the force, r^−α − A x³/3 − B x⁴/4 − C.
/// Source  GROMACS 2022 reference manual, "Modified non-bonded interactions", equations for F_s and Φ_s
struct ForceSwitch {
  double a = 0;
  double b = 0;
  double c = 0;
};
ForceSwitch force_switch(double alpha, double start_angstrom, double cutoff_angstrom);

}  // namespace tandem::docking

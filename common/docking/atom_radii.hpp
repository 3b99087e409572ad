// Van der Waals and covalent radii of the elements. The sum of two van der Waals radii is the usual minimum distance of
// unbound atoms; the sum of two covalent radii is the length of a bond.
#pragma once

#include <cstddef>
#include <string_view>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

struct AtomRadii {
  double van_der_waals_angstrom = 0;
  double covalent_angstrom = 0;
};

/// Returns the radii of an element. For an unknown symbol, returns the radii of the known element with the nearest
/// mass.
///
/// In      symbol  in upper case, such as "ZN"
///         mass_u  used if the symbol is not in the table
/// Source  van der Waals: Bondi, J. Phys. Chem. 68 (1964) 441; hydrogen: Rowland, Taylor, J. Phys. Chem. 100 (1996)
///         7384; metals: Alvarez, Dalton Trans. 42 (2013) 8617. Covalent: Cordero et al., Dalton Trans. (2008) 2832
const AtomRadii& atom_radii(std::string_view symbol, double mass_u);
const AtomRadii& atom_radii(const Molecule& molecule, std::size_t atom);

/// Maximum excess of a bond's length over the sum of the covalent radii [Å].
inline constexpr double kBondSlackAngstrom = 0.4;

}  // namespace tandem::docking

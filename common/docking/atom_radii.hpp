// Sizes of atoms: how near two of them come with a bond and without one.
#pragma once

#include <cstddef>
#include <string_view>

#include "common/docking/molecule.hpp"

namespace tandem::docking {

struct AtomRadii {
  double van_der_waals_angstrom = 0;
  double covalent_angstrom = 0;
};

/// Radii of an element; an unknown symbol has those of the known element of the nearest mass.
///
/// In      symbol  upper case: "ZN"
///         mass_u  counts where the symbol is not in the table
/// Source  van der Waals: Bondi, J. Phys. Chem. 68 (1964) 441; hydrogen: Rowland, Taylor, J. Phys. Chem. 100 (1996) 7384; metals:
///         Alvarez, Dalton Trans. 42 (2013) 8617. Covalent: Cordero et al., Dalton Trans. (2008) 2832
const AtomRadii& atom_radii(std::string_view symbol, double mass_u);
const AtomRadii& atom_radii(const Molecule& molecule, std::size_t atom);

/// A bond between two atoms is at most this much longer than the sum of their covalent radii [Å].
inline constexpr double kBondSlackAngstrom = 0.4;

}  // namespace tandem::docking

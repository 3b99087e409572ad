// Chemical elements: identifies the element of an atom in a structure file, and gives parameters for elements without
// an entry in the force field.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tandem::server {

struct ChemicalElement {
  std::string_view symbol;  ///< upper case: "HG"
  double mass_u = 0;
  double minimum_angstrom = 0;  ///< distance of the Lennard-Jones minimum of a pair of this element
  double well_kcal_per_mol = 0;

  double sigma_angstrom() const;
};

/// Returns null for anything but a symbol of hydrogen to lawrencium in upper case.
///
/// Source  masses: IUPAC, standard atomic weights 2021; for radioactive elements the mass number. Lennard-Jones
///         parameters: UFF, Rappé, Casewit, Colwell, Goddard, Skiff, JACS 114 (1992) 10024, first atom type of each
///         element
const ChemicalElement* find_element(std::string_view symbol);

std::span<const ChemicalElement> periodic_table();

/// Statements of a structure file from which the element of an atom is derived.
struct ElementClues {
  std::string_view name;     ///< PDB files: all four columns, if aligned; else without blanks
  std::string_view element;  ///< the file's own column or item; empty if it has none
  std::string_view residue;
};

/// Returns the symbol in upper case; "X" if no element is found. Deuterium and tritium count as hydrogen.
///
/// In standard residues (is_standard_residue()) only the first letter of the name counts, except for selenium in MSE:
/// they have no other element of two letters. Elsewhere the first rule that applies decides:
///   1. a lone ion, whose atom and residue have the same name
///   2. the stated element
///   3. the columns of the name, where an element's symbol ends in the second
///   4. symbols that begin no atom name of another element (CL, BR, ZN …)
///   5. the first letter
std::string element_of(const ElementClues& clues);

/// The twenty amino acids and their protonation variants, nucleotides, water.
bool is_standard_residue(std::string_view name);

}  // namespace tandem::server

// Chemical elements: identification of the element of an atom in a structure file, and parameters for elements that the
// force field lacks.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tandem::server {

struct ChemicalElement {
  std::string_view symbol;  ///< symbol in upper case: "HG"
  double mass_u = 0;
  double minimum_angstrom = 0;  ///< distance of the Lennard-Jones minimum of two atoms of this element
  double well_kcal_per_mol = 0;

  double sigma_angstrom() const;
};

/// Returns the element with this symbol (upper case, hydrogen to lawrencium); null for any other text.
///
/// Source  masses: IUPAC, standard atomic weights 2021; for a radioactive element its mass number. Lennard-Jones
///         parameters: UFF, Rappé, Casewit, Colwell, Goddard, Skiff, JACS 114 (1992) 10024; those of the first atom
///         type of each element
const ChemicalElement* find_element(std::string_view symbol);

std::span<const ChemicalElement> periodic_table();

/// Fields of a structure file from which the element of an atom is found.
struct ElementClues {
  std::string_view name;     ///< name; all four columns in a PDB file with aligned names, otherwise without blanks
  std::string_view element;  ///< element in the file; empty if the file has none
  std::string_view residue;
};

/// Returns the symbol in upper case; "X" if no element is found. Deuterium and tritium count as hydrogen.
///
/// In a standard residue (is_standard_residue()) the first letter of the atom name is the symbol, because all elements
///    of such residues have one letter. The exception is selenium in MSE. In other residues the first applicable rule
///    decides:
///   1. If atom and residue have the same name, the atom is a lone ion, and the name is the symbol.
///   2. If the file states an element, it is used.
///   3. In a PDB file, the columns of the name may determine the element, because the symbol ends in the second column.
///   4. Symbols are used with which no atom name of another element begins (CL, BR, ZN …).
///   5. Otherwise the first letter of the name is the symbol.
std::string element_of(const ElementClues& clues);

/// Returns true for the twenty amino acids and their protonation variants, nucleotides, and water.
bool is_standard_residue(std::string_view name);

}  // namespace tandem::server

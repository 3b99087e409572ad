// Chemical elements: which one an atom of a structure file is, and what stands in for it where no force field knows it.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tandem::server {

struct ChemicalElement {
  std::string_view symbol;  ///< upper case: "HG"
  double mass_u = 0;
  double minimum_angstrom = 0;  ///< distance of the Lennard-Jones minimum between two of them
  double well_kcal_per_mol = 0;

  double sigma_angstrom() const;
};

/// Null: not a symbol of hydrogen to lawrencium in upper case.
///
/// Source  masses: IUPAC, standard atomic weights 2021, of radioactive elements the mass number; Lennard-Jones parameters: UFF,
///         Rappé, Casewit, Colwell, Goddard, Skiff, JACS 114 (1992) 10024, of the element's first atom type
const ChemicalElement* find_element(std::string_view symbol);

std::span<const ChemicalElement> periodic_table();

/// What a structure file states of an atom that tells its element.
struct ElementClues {
  std::string_view name;     ///< of PDB files all four columns, where they are aligned; else without blanks
  std::string_view element;  ///< the file's own column or item; empty: it has none
  std::string_view residue;
};

/// The symbol in upper case; "X" for what names no element. Deuterium and tritium are hydrogen.
///
/// In order: a lone ion, whose atom and residue have one name; the stated element; the columns of the name, in which an element's
/// symbol ends in the second; symbols that begin no name of another element's atom (CL, BR, ZN …); the first letter. An amino acid
/// or nucleotide has no element of two letters but selenium: there the first letter of the name counts against any statement.
std::string element_of(const ElementClues& clues);

/// The twenty amino acids and their protonation variants, nucleotides, water.
bool is_standard_residue(std::string_view name);

}  // namespace tandem::server

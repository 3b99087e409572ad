// Residues of a structure file together with the atoms that the rules of a force field add: all atoms of a molecule.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/histidines.hpp"
#include "server/assets/structures/hydrogens.hpp"
#include "server/assets/structures/residue_blocks.hpp"
#include "server/assets/structures/structure_file.hpp"

namespace tandem::server {

struct PreparedStructure {
  std::vector<PdbResidue> chains;           ///< amino acids, caps and nucleotides that the force field has blocks for
  std::vector<PdbResidue> others;           ///< all other residues
  std::vector<ResidueContext> contexts;     ///< parallel to `chains`
  std::vector<HistidineChoice> histidines;  ///< parallel to `chains`
  Hydrogens hydrogens = Hydrogens::kGiven;  ///< resulting choice: given, built or united
  std::vector<BuiltGroup> groups;           ///< built hydrogens
  std::vector<std::string> rebuilt;         ///< for the user: residues whose given hydrogens were built anew
  std::vector<std::size_t> ended;           ///< residues of `chains` that got the OXT of a chain end
  PdbStructure read;                        ///< omissions of the reader; its residues are in `chains` and `others`
};

/// Reads a file and sorts its residues; nothing is added yet. Nucleotides of files from before 2007 get their present
/// names: O5' for O5*, and DA for an A without the hydroxyl of C2'.
/// Fails   MoleculeError: see read_structure()
PreparedStructure read_residues(const std::filesystem::path& structure, const ForceField& force_field);

/// Chooses histidines and chain ends, and builds hydrogens and ends. It processes all chains, selected or not:
/// disulfides and the hydrogens of a residue depend on other chains.
///
/// Fails   MoleculeError, naming `source`: alpha carbons only; hydrogens that this force field cannot build; more
///         cysteines than find_disulfides() allows
void complete_residues(PreparedStructure& structure, const ForceField& force_field, Hydrogens hydrogens,
                       const StructureSelection& selection, const std::string& source);

}  // namespace tandem::server

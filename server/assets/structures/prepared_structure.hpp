// A structure file's residues with what a force field's rules add to them: the atoms that a molecule is made of.
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
  std::vector<PdbResidue> others;           ///< all else
  std::vector<ResidueContext> contexts;     ///< of each residue of `chains`
  std::vector<HistidineChoice> histidines;  ///< likewise
  Hydrogens hydrogens = Hydrogens::kGiven;  ///< what was chosen: given, built or united
  std::vector<BuiltGroup> groups;           ///< hydrogens that were built
  std::vector<std::string> rebuilt;         ///< residues of which given hydrogens were built anew, for people
  std::vector<std::size_t> ended;           ///< residues of `chains` that were given the OXT of a chain's end
  PdbStructure read;                        ///< what the reader left out; its residues are in `chains` and `others`
};

/// Reads a file and sorts its residues; nothing is added yet. Nucleotides of files from before 2007 get the names of today: O5' for
/// O5*, and DA for an A without the hydroxyl of C2'.
/// Fails   MoleculeError: see read_structure()
PreparedStructure read_residues(const std::filesystem::path& structure, const ForceField& force_field);

/// Chooses histidines and chain ends, and builds hydrogens and ends, over all chains, also those that are not selected: a disulfide and
/// the hydrogens of a residue depend on others.
///
/// Fails   MoleculeError, naming `source`: alpha carbons only; hydrogens that this force field cannot build; more cysteines than
///         find_disulfides() takes
void complete_residues(PreparedStructure& structure, const ForceField& force_field, Hydrogens hydrogens,
                       const StructureSelection& selection, const std::string& source);

}  // namespace tandem::server

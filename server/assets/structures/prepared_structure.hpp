// Residues of a structure file, including the atoms that are added by the rules of a force field: all atoms from which
// a molecule is made. A block is the force field's entry for a residue.
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
  std::vector<PdbResidue> chains;           ///< amino acids, caps and nucleotides for which the force field has blocks
  std::vector<PdbResidue> others;           ///< all residues that are not in `chains`
  std::vector<ResidueContext> contexts;     ///< parallel to `chains`
  std::vector<HistidineChoice> histidines;  ///< parallel to `chains`
  Hydrogens hydrogens = Hydrogens::kGiven;  ///< kGiven, kBuild or kUnited, never kAsNeeded
  std::vector<BuiltGroup> groups;           ///< groups of the built hydrogens
  std::vector<std::string> rebuilt;         ///< residues of the file whose hydrogens were replaced; text for the user
  std::vector<std::size_t> ended;           ///< indices in `chains` of residues to which OXT was added at a chain end
  PdbStructure read;  ///< omissions that the reader has reported; its residues have been moved to `chains` and `others`
};

/// Reads a file and sorts its residues into `chains` and `others`, without adding atoms. Nucleotides of files from
/// before 2007 get their current names: O5* becomes O5', and A without the hydroxyl of C2' becomes DA.
/// Fails   MoleculeError: see read_structure()
PreparedStructure read_residues(const std::filesystem::path& structure, const ForceField& force_field);

/// Chooses the forms of histidines and chain ends, and builds missing hydrogens and end atoms. Chains that are not
/// selected are processed as well, because they affect the disulfides and hydrogens of selected chains.
///
/// Fails   MoleculeError, naming `source`: the file has alpha carbons only; the force field cannot build the requested
///         hydrogens; there are more cysteines than find_disulfides() allows
void complete_residues(PreparedStructure& structure, const ForceField& force_field, Hydrogens hydrogens,
                       const StructureSelection& selection, const std::string& source);

}  // namespace tandem::server

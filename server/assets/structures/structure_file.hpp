// Structure files of any format, and which of their atoms are wanted.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Reads PDB, mmCIF, PQR or PDBQT, also compressed by gzip, of at most 256 MiB of text. mmCIF is known by its first word, PQR and
/// PDBQT by the file's name (.pqr, .pqr.gz). The readers are written here, not taken from gemmi: it has none of PQR and PDBQT, ends with
/// an error at line numbers in columns 79-80, which old PDB files have, and keeps no account of what it leaves out.
///
/// Fails   MoleculeError naming the file: missing, too large, damaged; see the readers
PdbStructure read_structure(const std::filesystem::path& path);

/// Which residues are wanted: of each entry "A" chain A's amino acids, "A/478" the residues named 478 of chain A with
/// whatever they are, "/HOH" those of all chains, "A/*" and "/*" all there are. None: the amino acids of all chains.
struct StructureSelection {
  std::vector<std::string> entries;

  bool takes_chain(std::string_view chain) const;
  /// By name, amino acid or not.
  bool takes_residue(const PdbResidue& residue) const;
};

/// "FILE:A,B/478" as a command line has it; a colon that no entry follows belongs to the file's name.
struct StructureChoice {
  std::string file;
  StructureSelection selection;
};
StructureChoice structure_choice(const std::string& text);

}  // namespace tandem::server

// Reads structure files of any supported format, and selects residues.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Reads PDB, mmCIF, PQR or PDBQT, gzip-compressed or not, up to 256 MiB of text. mmCIF is detected by its first word,
/// PQR and PDBQT by the file name (.pqr, .pqr.gz). gemmi is not used: it has no readers for PQR and PDBQT, does not
/// report omissions, and fails at the line numbers in columns 79-80 of old PDB files.
///
/// Fails   MoleculeError naming the file, if it is missing, too large or damaged; see the readers
PdbStructure read_structure(const std::filesystem::path& path);

/// Selection of residues by entries:
/// * "A": the amino acids of chain A
/// * "A/478": the residues of chain A with the name 478, of any kind; "/HOH": those with the name HOH in all chains
/// * "A/*": all residues of chain A; "/*": all residues
/// * no entries: the amino acids of all chains
struct StructureSelection {
  std::vector<std::string> entries;

  bool takes_chain(std::string_view chain) const;
  /// Returns whether an entry selects the residue by its name or by "*". The residue may be of any kind.
  bool takes_residue(const PdbResidue& residue) const;
};

/// Result of structure_choice(): file and selection from a text of the form "FILE:CHAINS/RESIDUES". A colon belongs to
/// the file name if no entry follows it, or if a file with the whole text as its name exists.
struct StructureChoice {
  std::string file;
  StructureSelection selection;
};
StructureChoice structure_choice(const std::string& text);

}  // namespace tandem::server

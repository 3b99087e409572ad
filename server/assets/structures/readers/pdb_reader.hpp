// A tolerant reader of the PDB format's atoms. Real files break the format's rules (old versions of it, other
// programs' extensions, hand edits), so it takes what can be read without doubt and refuses only what cannot.
#pragma once

#include <string>
#include <string_view>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

enum class PdbFlavour {
  kPdb,
  kPdbqt,  ///< AutoDock's: charges and atom types of its own behind the temperature factor
};

/// Reads ATOM and HETATM records of the first model, up to ENDMDL or END.
///
/// Columns 55-80 may be missing or hold anything, except in a PDBQT file. LF or CRLF.
///
/// In      source  name of the file, for messages
/// Fails   MoleculeError with file and line: an atom line without three coordinates within 1e6 Å, in a PDBQT file without a charge
///         within 100 e; too many atoms
PdbStructure parse_pdb(std::string_view text, const std::string& source, PdbFlavour flavour = PdbFlavour::kPdb);

}  // namespace tandem::server

// A tolerant reader of the atoms of a PDB file. Real files deviate from the format: old versions, extensions by other
// programs, manual edits. The reader accepts every deviation that is unambiguous and refuses the others.
#pragma once

#include <string>
#include <string_view>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

enum class PdbFlavour {
  kPdb,
  kPdbqt,  ///< AutoDock's format, with charges and atom types after the temperature factor
};

/// Reads ATOM and HETATM records of the first model, up to ENDMDL or END.
///
/// Columns 55-80 may be missing or contain anything, except in a PDBQT file. Lines end with LF or CRLF.
///
/// In      source  name of the file, for messages
/// Fails   MoleculeError with file and line: an atom line lacks three coordinates within 1e6 Å; an atom of a PDBQT file
///         lacks a charge within 100 e; there are too many atoms
PdbStructure parse_pdb(std::string_view text, const std::string& source, PdbFlavour flavour = PdbFlavour::kPdb);

}  // namespace tandem::server

// Reads the atoms of an mmCIF file. They are in its _atom_site loop; the rest of the file is ignored.
#pragma once

#include <string>
#include <string_view>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Reads the first model of the first data block with atoms. If the file has the names, numbers and chains of the
/// authors (auth_…), these are used, as in the PDB file of the same entry. gemmi's reader is not used, because this
/// reader needs only one loop, one pass and no copy of the file.
///
/// Source  Hall, Allen, Brown, Acta Cryst. A47 (1991) 655 and iucr.org "CIF 1.1 syntax": words, quotes, text fields
/// In      source  name of the file, for messages
/// Fails   MoleculeError with file and line: there is no _atom_site loop; a coordinate is missing, or not a number
///         within 1e6 Å; a row is incomplete; there are too many atoms
PdbStructure parse_mmcif(std::string_view text, const std::string& source);

}  // namespace tandem::server

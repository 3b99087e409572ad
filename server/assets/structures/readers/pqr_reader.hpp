// Reads the PQR format of PDB2PQR and APBS, whose atoms have a charge and a radius, in columns separated by blanks.
#pragma once

#include <string>
#include <string_view>

#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

/// Reads ATOM and HETATM records: serial, atom, residue, chain (optional), number, x y z, charge, radius. Some programs
/// write a chain end as a separate residue (NTER, NTE, CTER, CTE). It is joined to the residue with the same number.
///
/// In      source  name of the file, for messages
/// Fails   MoleculeError with file and line: a record lacks numbers, or its charge exceeds 100 e or its radius 10 Å
PdbStructure parse_pqr(std::string_view text, const std::string& source);

}  // namespace tandem::server

// A tolerant reader of the PDB format's atoms. Real files break the format's rules (old versions of it, other
// programs' extensions, hand edits), so it takes what can be read without doubt and refuses only what cannot.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/docking/molecule_error.hpp"

namespace tandem::server {

struct PdbAtom {
  std::string name;     ///< as in the file: "CA", "1HB"
  std::string element;  ///< "C": from the name, which files have right more often than columns 77-78; "SE" of those
  Vec3 position_angstrom = Vec3::Zero();
};

struct PdbResidue {
  std::string name;  ///< columns 18-21: four letters, as GROMACS and CHARMM write them
  std::string id;    ///< number and insertion code, "12A"
  std::string chain;
  int segment = 0;  ///< counts the TER records before it
  std::vector<PdbAtom> atoms;
};

struct PdbStructure {
  std::vector<PdbResidue> residues;  ///< in file order
  std::size_t alternate_atoms = 0;   ///< left out: of another alternate location than the first
  std::size_t duplicate_atoms = 0;   ///< left out: name and residue were there already
  bool has_more_models = false;      ///< left out: all models but the first
};

/// Reads ATOM and HETATM records of the first model, up to ENDMDL or END.
///
/// Of each residue the first alternate location is kept, and of an atom that it lacks the first one given; of two
/// residue names at one place the first. Columns 55-80 may be missing or hold anything. LF or CRLF.
///
/// In      source  name of the file, for messages
/// Fails   MoleculeError with file and line: an atom line without three coordinates within 1e6 Å, more than 1,000,000
///         atoms; with file: mmCIF or compressed data
PdbStructure parse_pdb(std::string_view text, const std::string& source);

/// parse_pdb() of a file of at most 256 MiB.
PdbStructure read_pdb(const std::filesystem::path& path);

}  // namespace tandem::server

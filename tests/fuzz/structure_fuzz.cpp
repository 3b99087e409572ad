// Any bytes as a structure file, of the format that the first byte chooses: what is read is finite, within the limits and
// hangs together, or it is refused in one line.
#include <array>
#include <cstdint>
#include <string>

#include "server/assets/structures/mmcif_reader.hpp"
#include "server/assets/structures/pdb_reader.hpp"
#include "server/assets/structures/pqr_reader.hpp"
#include "tests/fuzz/check.hpp"

namespace {

using namespace tandem;
using fuzz::check;

void check(const server::PdbStructure& structure) {
  for (const server::PdbResidue& residue : structure.residues) {
    check(!residue.atoms.empty());
    for (const server::PdbAtom& atom : residue.atoms) {
      check(atom.position_angstrom.allFinite());
      check(atom.position_angstrom.cwiseAbs().maxCoeff() <= server::kMaxCoordinateAngstrom);
      server::element_of(atom.name, atom.element, residue.name);
      check(server::place_text(residue, atom.name).find('\n') == std::string::npos);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  constexpr std::array kParsers{&server::parse_pdb, &server::parse_mmcif, &server::parse_pqr};
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    check(kParsers[data[0] % kParsers.size()](text, "fuzz"));
  } catch (const docking::MoleculeError& error) {
    const std::string line = error.what();
    check(!line.empty() && line.find('\n') == std::string::npos);
  }
  return 0;
}

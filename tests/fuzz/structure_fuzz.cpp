// Reads arbitrary bytes as a structure file in the format that the first byte selects. The coordinates of an accepted
// structure must be finite and within the limit, and no residue may be empty. A refusal must be an error of one line.
#include <cstdint>
#include <string>
#include <string_view>

#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/histidines.hpp"
#include "server/assets/structures/readers/mmcif_reader.hpp"
#include "server/assets/structures/readers/pdb_reader.hpp"
#include "server/assets/structures/readers/pqr_reader.hpp"
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
      check(!atom.element.empty());
      check(server::place_text(residue, atom.name).find('\n') == std::string::npos);
    }
  }
  check(server::chain_links(structure.residues).size() == structure.residues.size());
  check(server::choose_histidines(structure.residues, {}).size() == structure.residues.size());
}

server::PdbStructure parse(unsigned format, std::string_view text) {
  constexpr unsigned kFormats = 4;
  switch (format % kFormats) {
    case 0:
      return server::parse_pdb(text, "fuzz");
    case 1:
      return server::parse_mmcif(text, "fuzz");
    case 2:
      return server::parse_pqr(text, "fuzz");
    default:
      return server::parse_pdb(text, "fuzz", server::PdbFlavour::kPdbqt);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    check(parse(data[0], text));
  } catch (const docking::MoleculeError& error) {
    const std::string line = error.what();
    check(!line.empty() && line.find('\n') == std::string::npos);
  }
  return 0;
}

// Sums of charges, which find most of what is wrong with a structure: a molecule has whole electrons.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/docking/molecule.hpp"
#include "server/assets/structures/residue_collector.hpp"

namespace tandem::server {

struct ChainCharge {
  std::string chain;
  double charge_e = 0;
};

struct NetCharge {
  double total_e = 0;
  std::vector<ChainCharge> chains;             ///< in file order
  std::vector<std::string> fractional_chains;  ///< "A (+2.38 e)": of which the sum is not whole
  /// Residues whose charge is not that of their block; in chains whose sum is not whole also residues that are not whole themselves.
  std::vector<std::string> suspects;

  bool is_whole() const { return fractional_chains.empty(); }
};

/// What the block of a residue, complete, would have.
struct ImpliedCharge {
  std::size_t first_atom = 0;  ///< of the molecule
  double charge_e = 0;
};

/// Model   whole within 0.02 e of a chain: files and force fields give charges with three or four decimals
/// In      implied  of residues for which it is known, ascending
NetCharge net_charge(const docking::Molecule& molecule, const std::vector<ImpliedCharge>& implied = {});

/// "+2" where it is whole, else "+2.38".
std::string signed_charge(double charge_e);

/// "+3 e (A +4, B -1)"
std::string charge_text(const NetCharge& charge);

/// The charge of a group that a force field does not know: the file's own formal charges, or what the name of a common ion, cofactor or
/// modified residue implies. Nothing: not known.
std::optional<int> formal_charge_of(const PdbResidue& residue);

}  // namespace tandem::server

// Sums of the charges of a molecule. A sum that is not a whole number reveals an error of the structure, such as
// missing atoms.
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
  std::vector<ChainCharge> chains;             ///< charges of the chains, in file order
  std::vector<std::string> fractional_chains;  ///< chains whose sum is not a whole number: "A (+2.38 e)"
  /// Residues whose charge differs from that of their block (force-field entry). In a chain whose sum is not a whole
  /// number, also residues whose charge is not a whole number.
  std::vector<std::string> suspects;

  bool is_whole() const { return fractional_chains.empty(); }
};

/// Charge that a residue would have if all atoms of its block (force-field entry) were present.
struct ImpliedCharge {
  std::size_t first_atom = 0;  ///< index in the molecule
  double charge_e = 0;
};

/// Returns the sums of the charges of a molecule and of its chains, and the residues that cause a fractional sum.
///
/// Model   A sum within 0.02 e of a whole number counts as whole, because files and force fields give charges with
///         three or four decimals
/// In      implied  charges of the residues that have a known block, in ascending order of first_atom
NetCharge net_charge(const docking::Molecule& molecule, const std::vector<ImpliedCharge>& implied = {});

/// Formats a charge, e.g. "+2" if it is whole, otherwise "+2.38".
std::string signed_charge(double charge_e);

/// Formats all sums, e.g. "+3 e (A +4, B -1)".
std::string charge_text(const NetCharge& charge);

/// Returns the charge of a group that the force field lacks: the sum of the formal charges in the file. If the file has
/// none, returns the charge of the common ion, cofactor or modified residue with the name of the group; nothing for
/// other names.
std::optional<int> formal_charge_of(const PdbResidue& residue);

}  // namespace tandem::server

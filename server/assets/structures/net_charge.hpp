// Sums of charges. They reveal most errors of a structure, because the charge of a molecule is a whole number.
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
  std::vector<std::string> fractional_chains;  ///< chains whose sum is not whole: "A (+2.38 e)"
  /// Residues whose charge differs from the charge of their block. In chains with a fractional sum also residues with a
  /// fractional charge.
  std::vector<std::string> suspects;

  bool is_whole() const { return fractional_chains.empty(); }
};

/// Charge that the complete block of a residue would have.
struct ImpliedCharge {
  std::size_t first_atom = 0;  ///< index in the molecule
  double charge_e = 0;
};

/// Model   whole within 0.02 e for each chain: files and force fields give charges with three or four decimals
/// In      implied  for residues with a known charge, in ascending order
NetCharge net_charge(const docking::Molecule& molecule, const std::vector<ImpliedCharge>& implied = {});

/// "+2" for a whole charge, else "+2.38".
std::string signed_charge(double charge_e);

/// "+3 e (A +4, B -1)"
std::string charge_text(const NetCharge& charge);

/// Charge of a group that the force field lacks: the formal charges of the file, or the charge implied by the name of a
/// common ion, cofactor or modified residue. Nothing if unknown.
std::optional<int> formal_charge_of(const PdbResidue& residue);

}  // namespace tandem::server

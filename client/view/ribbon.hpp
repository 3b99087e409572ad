// Chains of a molecule as ribbons. No window is needed.
#pragma once

#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

/// Appends a ribbon for each chain of at least three residues: wide along helices, with an arrow at the end of strands,
/// and a tube elsewhere. Nucleic acids get a tube with a rod for each base. Atoms outside of chains (ligands, ions,
/// water), and molecules without names, are drawn as sticks.
///
/// Model   a Catmull-Rom spline through the α carbons (C4' of nucleotides), which are smoothed first in strands. The
///         width is in the plane of the peptides. A residue belongs to a helix or a strand according to its distances
///         to the α carbons of the second, third and fourth residue after it
/// In      colors  one for each atom; a residue has the colour of its α carbon
///         stop    after a stop request nothing more is appended
/// Source  planes: Carson and Bugg, "Algorithm for ribbon models of proteins", J. Mol. Graphics 4, 1986; distances:
///         Labesse et al., "P-SEA: a new efficient assignment of secondary structure from Cα trace of proteins", CABIOS
///         13, 1997, without its angles
void append_ribbon(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

}  // namespace tandem::client

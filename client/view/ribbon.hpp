// Chains of a molecule as ribbons. Needs no window.
#pragma once

#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

/// Appends a ribbon for each chain of three residues or more: wide along helices, with an arrow at the end of strands,
/// a tube elsewhere. Nucleic acids get a tube with a rod for each base. Atoms outside of chains (ligands, ions, water)
/// are drawn as sticks, and so is a molecule without names.
///
/// Model   a Catmull-Rom spline through the α carbons (C4' of nucleotides), smoothed first in strands, with its width
///         in the plane of the peptides. A residue belongs to a helix or strand according to its distances to the α
///         carbons two, three and four residues further on
/// In      colors  one for each atom; a residue has that of its α carbon
///         stop    once requested, nothing more is appended
/// Source  planes: Carson and Bugg, "Algorithm for ribbon models of proteins", J. Mol. Graphics 4, 1986; distances:
///         Labesse et al., "P-SEA: a new efficient assignment of secondary structure from Cα trace of proteins", CABIOS
///         13, 1997, without its angles
void append_ribbon(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

}  // namespace tandem::client

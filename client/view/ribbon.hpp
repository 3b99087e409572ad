// Computes the ribbon drawing of a molecule's chains. No window is needed.
#pragma once

#include <span>
#include <stop_token>

#include "client/view/drawn_molecule.hpp"

namespace tandem::client {

/// Appends the drawing of a molecule. Each chain of at least three residues is a ribbon:
/// * Proteins: wide along helices and strands, with an arrow at the end of each strand; a tube elsewhere.
/// * Nucleic acids: a tube, with a rod for each base.
/// * Atoms outside of chains (ligands, ions, water), and molecules without atom names, are drawn as sticks.
///
/// Model   a Catmull-Rom spline through the α carbons (through C4' in nucleotides). In strands, the positions of the α
///         carbons are smoothed first. The width of the ribbon lies in the plane of the peptide bonds. Helices and
///         strands are detected by the distances from an α carbon to the α carbons of the second, third and fourth
///         residue after it
/// In      colors  one for each atom; the ribbon has the colours of the α carbons
///         stop    after a stop request nothing more is appended
/// Source  plane of the ribbon: Carson and Bugg, "Algorithm for ribbon models of proteins", J. Mol. Graphics 4, 1986.
///         Distances: Labesse et al., "P-SEA: a new efficient assignment of secondary structure from Cα trace of
///         proteins", CABIOS 13, 1997; its criteria for angles are not used
void append_ribbon(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

}  // namespace tandem::client

// Molecules as triangles: balls, sticks, ribbons. No window is needed for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "client/view/drawn_mesh.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::client {

/// How molecules are drawn.
struct MoleculeStyle {
  enum Shape : std::uint8_t { kBalls, kSticks, kSurface, kRibbon };
  enum Colors : std::uint8_t { kByElement, kByChain, kByResidue };
  static constexpr std::array<const char*, 4> kShapeNames{"balls", "sticks", "surface", "ribbon"};  ///< by their number
  static constexpr std::array<const char*, 3> kColorNames{"element", "chain", "residue"};

  Shape shape = kBalls;
  Colors colors = kByElement;

  bool operator==(const MoleculeStyle&) const = default;
};

/// One for each atom. By element: carbons in the molecule's own colour, the others as is usual (nitrogen blue, oxygen red,
/// sulphur yellow, hydrogen white). By chain: chain_color() of `first_chain` and so on, as they come in the file. By
/// residue: acidic red, basic blue, polar teal, the other amino acids sand, nucleotides purple, all else dark grey. By
/// element where a molecule has no names.
/// Source  chains: Tol, "Colour schemes", SRON/EPS/TN/09-002, 2021 ("muted")
std::vector<Rgba> atom_colors(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                              std::size_t first_chain = 0);
/// Nine, again from the tenth.
Rgba chain_color(std::size_t chain);
/// By their names.
std::size_t chain_count(const docking::Molecule& molecule);

/// Adds a ball for each atom, of its van der Waals radius; of more than a quarter of a million atoms one for some that follow
/// each other, of their volume.
/// In      colors  one for each atom
///         stop    once requested, no more is added; likewise the others
void append_balls(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                  std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Likewise, but of so many atoms only balls, with a small ball for each atom and a stick, of both atoms' colours, for each bond: two atoms nearer than their
/// covalent radii and 0.4 Å.
/// Source  radii: Cordero et al., Dalton Trans. 2832 (2008)
void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Of its element: by name, else by mass.
double van_der_waals_radius_angstrom(const docking::Molecule& molecule, std::size_t atom);

}  // namespace tandem::client

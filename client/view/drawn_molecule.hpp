// Molecules as triangle meshes: balls, sticks, ribbons. Needs no window.
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

/// Style in which molecules are drawn.
struct MoleculeStyle {
  enum Shape : std::uint8_t { kBalls, kSticks, kSurface, kRibbon };
  enum Colors : std::uint8_t { kByElement, kByChain, kByResidue };
  static constexpr std::array<const char*, 4> kShapeNames{"balls", "sticks", "surface",
                                                          "ribbon"};  ///< indexed by Shape
  static constexpr std::array<const char*, 3> kColorNames{"element", "chain", "residue"};

  Shape shape = kBalls;
  Colors colors = kByElement;

  bool operator==(const MoleculeStyle&) const = default;
};

/// One colour per atom. By element: carbons in the molecule's own colour, others in the usual colours (nitrogen blue,
/// oxygen red, sulphur yellow, hydrogen white). By chain: chain_color() from `first_chain` on, in the order of the
/// file. By residue: acidic red, basic blue, polar teal, the other amino acids sand, nucleotides purple, all else dark
/// grey. Molecules without names are coloured by element.
/// Source  chains: Tol, "Colour schemes", SRON/EPS/TN/09-002, 2021 ("muted")
std::vector<Rgba> atom_colors(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                              std::size_t first_chain = 0);
/// One of nine colours, repeated from the tenth chain on.
Rgba chain_color(std::size_t chain);
/// Number of different chain names.
std::size_t chain_count(const docking::Molecule& molecule);

/// Appends a ball of the van der Waals radius for each atom. Above a quarter of a million atoms a ball represents
/// several consecutive atoms and has their total volume.
/// In      colors  one for each atom
///         stop    once requested, nothing more is appended; also in the functions below
void append_balls(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                  std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Appends a small ball for each atom, and a stick in both atoms' colours for each bond. Two atoms are bonded if they
/// are nearer than the sum of their covalent radii plus 0.4 Å. Above a quarter of a million atoms as append_balls().
/// Source  radii: Cordero et al., Dalton Trans. 2832 (2008)
void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Radius of the atom's element, found by name, otherwise by mass.
double van_der_waals_radius_angstrom(const docking::Molecule& molecule, std::size_t atom);

}  // namespace tandem::client

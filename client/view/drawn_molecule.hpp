// Molecules as triangle meshes: balls, sticks and ribbons. No window is needed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "client/view/drawn_mesh.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::client {

/// Style in which molecules are drawn.
struct MoleculeStyle {
  enum Shape : std::uint8_t { kBalls, kSticks, kSurface, kRibbon };
  enum Colors : std::uint8_t { kByElement, kByChain, kByResidue };
  static constexpr std::array<const char*, 4> kShapeNames{"balls", "sticks", "surface",
                                                          "ribbon"};  ///< names of the shapes, indexed by Shape
  static constexpr std::array<const char*, 3> kColorNames{"element", "chain", "residue"};

  Shape shape = kBalls;
  Colors colors = kByElement;

  bool operator==(const MoleculeStyle&) const = default;
};

/// Returns one colour per atom:
/// * by element: carbon has the molecule's colour `own`, other elements the usual colours (nitrogen blue, oxygen red,
///   sulphur yellow, hydrogen white);
/// * by chain: chain_color(), with the number `first_chain` for the first chain of the file;
/// * by residue: acidic red, basic blue, polar teal, other amino acids sand, nucleotides purple, all others dark grey.
///
/// Molecules without names of residues and chains are coloured by element.
/// Source  chains: Tol, "Colour schemes", SRON/EPS/TN/09-002, 2021 ("muted")
std::vector<Rgba> atom_colors(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                              std::size_t first_chain = 0);
/// A colour of a molecule and its meaning, such as "N" or "chain B".
struct LegendEntry {
  std::string text;
  Rgba color{};

  bool operator==(const LegendEntry&) const = default;
};
/// Returns the meanings of the colours that atom_colors() returns for these arguments, each once.
std::vector<LegendEntry> legend_of(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                                   std::size_t first_chain = 0);
/// Returns one of nine colours, which repeat from the tenth chain on.
Rgba chain_color(std::size_t chain);
/// Returns the number of different chain names.
std::size_t chain_count(const docking::Molecule& molecule);

/// Appends a ball with the van der Waals radius for each atom. Above a quarter of a million atoms, each ball represents
/// several consecutive atoms and has their total volume.
/// In      colors  one for each atom
///         stop    once a stop is requested, nothing more is appended; the functions below have the same parameter
void append_balls(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                  std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Appends a small ball for each atom, and a stick for each bond. A stick has the colours of its two atoms. Two atoms
/// are bonded if their distance is below the sum of their covalent radii plus 0.4 Å. Above a quarter of a million
/// atoms, draws the molecule like append_balls().
/// Source  radii: Cordero et al., Dalton Trans. 2832 (2008)
void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop = {});

/// Returns the van der Waals radius of an atom. The element is found by the atom's name, or by its mass if the name is
/// unknown.
double van_der_waals_radius_angstrom(const docking::Molecule& molecule, std::size_t atom);

}  // namespace tandem::client

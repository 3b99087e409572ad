#include "client/view/drawn_molecule.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "common/docking/atom_radii.hpp"
#include "common/net/text.hpp"

namespace tandem::client {
namespace {

/// Number of atoms above which balls have fewer triangles.
constexpr std::size_t kFineAtoms = 1500;
/// Number of atoms above which balls are octahedra with the normals of a sphere, and sticks have few sides. With so
/// many atoms, a ball or stick is only a few pixels wide.
constexpr std::size_t kCoarseAtoms = 20'000;
constexpr int kSides = 20, kCoarseSides = 5;
/// Number of atoms above which each ball represents several atoms, and no sticks are drawn. For the largest molecule
/// that a server may send, this limits the vertices to a quarter of a gigabyte.
constexpr std::size_t kMaxBalls = 250'000;

/// Colours of the elements except carbon, which has the colour of its molecule.
struct Element {
  std::string_view symbol;
  double mass_u;
  Rgba color;
};

constexpr Rgba kGreen{0.20F, 0.70F, 0.20F, 1}, kMetal{0.49F, 0.50F, 0.69F, 1};
constexpr std::array<Element, 19> kElements{{{"H", 1.008, {0.93F, 0.93F, 0.93F, 1}},
                                             {"C", 12.011, {}},
                                             {"N", 14.007, {0.10F, 0.35F, 0.85F, 1}},
                                             {"O", 15.999, {0.84F, 0.18F, 0.10F, 1}},
                                             {"F", 18.998, kGreen},
                                             {"NA", 22.990, kMetal},
                                             {"MG", 24.305, kMetal},
                                             {"P", 30.974, {0.90F, 0.45F, 0.05F, 1}},
                                             {"S", 32.06, {0.93F, 0.82F, 0.20F, 1}},
                                             {"CL", 35.45, kGreen},
                                             {"K", 39.098, kMetal},
                                             {"CA", 40.078, kMetal},
                                             {"MN", 54.938, kMetal},
                                             {"FE", 55.845, kMetal},
                                             {"CU", 63.546, kMetal},
                                             {"ZN", 65.38, kMetal},
                                             {"SE", 78.971, {0.90F, 0.60F, 0.05F, 1}},
                                             {"BR", 79.904, {0.55F, 0.15F, 0.10F, 1}},
                                             {"I", 126.904, {0.45F, 0.10F, 0.55F, 1}}}};

/// Returns an atom's element. For an unknown symbol, it is the element with the nearest mass.
const Element& element_of(const docking::Molecule& molecule, std::size_t atom) {
  const auto* found = kElements.end();
  if (atom < molecule.elements.size()) found = std::ranges::find(kElements, molecule.elements[atom], &Element::symbol);
  if (found == kElements.end()) {
    const double mass_u = molecule.mass_u[atom];
    found = std::ranges::min_element(kElements, {}, [mass_u](const Element& e) { return std::abs(e.mass_u - mass_u); });
  }
  return *found;
}

Rgba element_color(const docking::Molecule& molecule, std::size_t atom, const Rgba& own) {
  const Element& element = element_of(molecule, atom);
  return element.symbol == "C" ? own : element.color;
}

/// A kind of residues with a colour of its own.
struct ResidueKind {
  const char* name;
  Rgba color;
};

/// Returns the kind of a residue, found by the first three letters of its name. Further letters are ignored, because
/// some force fields append the protonation state. Three-letter names of protonation states, such as ASH for ASP, are
/// listed too.
const ResidueKind& residue_kind(std::string_view name) {
  static constexpr ResidueKind kAcidic{"acidic", {0.80F, 0.20F, 0.07F, 1}}, kBasic{"basic", {0.00F, 0.27F, 0.67F, 1}},
      kPolar{"polar", {0.27F, 0.67F, 0.60F, 1}}, kApolar{"apolar", {0.87F, 0.80F, 0.47F, 1}},
      kNucleotide{"nucleotide", {0.67F, 0.27F, 0.60F, 1}}, kOther{"other", {0.35F, 0.35F, 0.35F, 1}};
  constexpr auto kIn = [](std::string_view list, std::string_view text) {
    return text.size() == 3 && text.find(' ') == std::string_view::npos && list.find(text) != std::string_view::npos;
  };
  const std::string_view three = name.substr(0, 3);
  if (kIn("ASP ASH GLU GLH", three)) return kAcidic;
  if (kIn("LYS LYN LSN LYP ARG HIS HID HIE HIP HSD HSE HSP", three)) return kBasic;
  if (kIn("SER THR ASN GLN TYR CYS CYX CYM", three)) return kPolar;
  if (kIn("ALA VAL LEU ILE MET MSE PHE TRP PRO GLY", three)) return kApolar;
  const std::string_view base = name.size() == 2 && name[0] == 'D' ? name.substr(1) : name;
  const bool is_nucleotide = base.size() == 1 && std::string_view("ACGTUI").find(base) != std::string_view::npos;
  return is_nucleotide ? kNucleotide : kOther;
}

/// Returns true if the molecule has names of chains and residues, which two of the colourings need.
bool has_names(const docking::Molecule& molecule) {
  return molecule.chains.size() == molecule.size() && molecule.residue_names.size() == molecule.size();
}

constexpr double kBallAngstrom = 0.42;
constexpr double kStickAngstrom = 0.18;
constexpr double kMaxBondAngstrom = 2.6;
/// Limits for molecules that are not chemically possible, because a server may send any: atoms in a cube with the edge
/// kMaxBondAngstrom, and bonds of one atom. Real molecules are far below both.
constexpr std::size_t kMaxAtomsInCell = 32, kMaxBonds = 16;

int halvings_for(const docking::Molecule& molecule, int fine) {
  if (molecule.size() <= kFineAtoms) return fine;
  return molecule.size() <= kCoarseAtoms ? 1 : 0;
}

/// In      unit  mesh of radius 1
void append_ball(DrawnMesh& out, const DrawnMesh& unit, const Vec3& centre_m, double radius_m, const Rgba& color) {
  const std::array<std::uint8_t, 4> bytes = bytes_of(color);
  const std::array<float, 3> centre = floats_of(centre_m);
  for (Vertex vertex : unit) {
    vertex.normal = vertex.position_m;
    for (std::size_t i = 0; i < 3; ++i) {
      vertex.position_m[i] = centre[i] + static_cast<float>(radius_m) * vertex.position_m[i];
    }
    vertex.color = bytes;
    out.push_back(vertex);
  }
}

/// Returns the bonded pairs of atoms. So that the cost is linear, atoms are sorted into cells whose edge is the longest
/// bond length, and only atoms of neighbouring cells are compared.
std::vector<std::pair<std::size_t, std::size_t>> bonds_of(const docking::Molecule& molecule,
                                                          const std::stop_token& stop) {
  using Cell = std::array<int, 3>;
  const auto cell_of = [&molecule](std::size_t atom) -> Cell {
    const Vec3 cell = (molecule.positions_angstrom[atom] / kMaxBondAngstrom).array().floor();
    return {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())};
  };
  const auto is_bond = [&molecule](std::size_t a, std::size_t b) {
    const double reach = docking::atom_radii(molecule, a).covalent_angstrom +
                         docking::atom_radii(molecule, b).covalent_angstrom + docking::kBondSlackAngstrom;
    const double apart = (molecule.positions_angstrom[a] - molecule.positions_angstrom[b]).norm();
    return apart > 0 && apart < std::min(reach, kMaxBondAngstrom);
  };
  std::map<Cell, std::vector<std::size_t>> cells;
  std::vector<std::pair<std::size_t, std::size_t>> bonds;
  for (std::size_t atom = 0; atom < molecule.size() && !stop.stop_requested(); ++atom) {
    const Cell own = cell_of(atom);
    const std::size_t most = bonds.size() + kMaxBonds;
    for (int i = 0; i < 27; ++i) {
      const auto near = cells.find({own[0] + i % 3 - 1, own[1] + i / 3 % 3 - 1, own[2] + i / 9 - 1});
      if (near == cells.end()) continue;
      for (const std::size_t other : near->second) {
        if (bonds.size() < most && is_bond(atom, other)) bonds.emplace_back(other, atom);
      }
    }
    if (std::vector<std::size_t>& here = cells[own]; here.size() < kMaxAtomsInCell) here.push_back(atom);
  }
  return bonds;
}

}  // namespace

double van_der_waals_radius_angstrom(const docking::Molecule& molecule, std::size_t atom) {
  return docking::atom_radii(molecule, atom).van_der_waals_angstrom;
}

Rgba chain_color(std::size_t chain) {
  constexpr std::array<Rgba, 9> kColors{{{0.53F, 0.80F, 0.93F, 1},
                                         {0.80F, 0.40F, 0.47F, 1},
                                         {0.87F, 0.80F, 0.47F, 1},
                                         {0.07F, 0.47F, 0.20F, 1},
                                         {0.67F, 0.27F, 0.60F, 1},
                                         {0.27F, 0.67F, 0.60F, 1},
                                         {0.20F, 0.13F, 0.53F, 1},
                                         {0.60F, 0.60F, 0.20F, 1},
                                         {0.53F, 0.13F, 0.33F, 1}}};
  return kColors[chain % kColors.size()];
}

std::size_t chain_count(const docking::Molecule& molecule) {
  return std::set<std::string_view>(molecule.chains.begin(), molecule.chains.end()).size();
}

std::vector<Rgba> atom_colors(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                              std::size_t first_chain) {
  const bool is_named = has_names(molecule);
  std::map<std::string_view, std::size_t> chains;
  std::vector<Rgba> found(molecule.size());
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    if (!is_named || colors == MoleculeStyle::kByElement) {
      found[atom] = element_color(molecule, atom, own);
    } else if (colors == MoleculeStyle::kByChain) {
      const auto chain = chains.try_emplace(molecule.chains[atom], first_chain + chains.size()).first;
      found[atom] = chain_color(chain->second);
    } else {
      found[atom] = residue_kind(molecule.residue_names[atom]).color;
    }
  }
  return found;
}

std::vector<LegendEntry> legend_of(const docking::Molecule& molecule, MoleculeStyle::Colors colors, const Rgba& own,
                                   std::size_t first_chain) {
  const bool is_by_element = !has_names(molecule) || colors == MoleculeStyle::kByElement;
  const std::vector<Rgba> of_atoms = atom_colors(molecule, colors, own, first_chain);
  const auto text_of_atom = [&](std::size_t atom) -> std::string_view {
    if (is_by_element) return element_of(molecule, atom).symbol;
    if (colors == MoleculeStyle::kByChain) return molecule.chains[atom];
    return residue_kind(molecule.residue_names[atom]).name;
  };
  std::set<std::string_view> seen;
  std::vector<LegendEntry> legend;
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    const std::string_view text = text_of_atom(atom);
    if (!seen.insert(text).second) continue;
    legend.push_back(
        {(!is_by_element && colors == MoleculeStyle::kByChain ? "chain " : "") + net::printable(text), of_atoms[atom]});
  }
  return legend;
}

void append_balls(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                  std::span<const Rgba> colors, const std::stop_token& stop) {
  DrawnMesh unit;
  append_mesh(unit, halved_octahedron(halvings_for(molecule, 3)), Pose{}, Rgba{1, 1, 1, 1});
  const std::size_t each = std::max<std::size_t>(1, (molecule.size() + kMaxBalls - 1) / kMaxBalls);
  out.reserve(out.size() + (molecule.size() + each - 1) / each * unit.size());
  for (std::size_t first = 0; first < molecule.size() && !stop.stop_requested(); first += each) {
    const std::size_t end = std::min(first + each, molecule.size());
    Vec3 middle = Vec3::Zero();
    double cubes = 0;
    for (std::size_t atom = first; atom < end; ++atom) {
      middle += molecule.positions_angstrom[atom] / static_cast<double>(end - first);
      cubes += std::pow(van_der_waals_radius_angstrom(molecule, atom), 3);
    }
    append_ball(out, unit, middle * metres_per_angstrom, std::cbrt(cubes) * metres_per_angstrom, colors[first]);
  }
}

void append_sticks(DrawnMesh& out, const docking::Molecule& molecule, double metres_per_angstrom,
                   std::span<const Rgba> colors, const std::stop_token& stop) {
  if (molecule.size() > kMaxBalls) return append_balls(out, molecule, metres_per_angstrom, colors, stop);
  DrawnMesh unit;
  append_mesh(unit, halved_octahedron(halvings_for(molecule, 2)), Pose{}, Rgba{1, 1, 1, 1});
  const auto at = [&](std::size_t atom) -> Vec3 { return molecule.positions_angstrom[atom] * metres_per_angstrom; };
  for (std::size_t atom = 0; atom < molecule.size() && !stop.stop_requested(); ++atom) {
    append_ball(out, unit, at(atom), kBallAngstrom * metres_per_angstrom, colors[atom]);
  }
  const int sides = molecule.size() <= kCoarseAtoms ? kSides : kCoarseSides;
  for (const auto& [a, b] : bonds_of(molecule, stop)) {
    if (stop.stop_requested()) return;
    const Vec3 middle = (at(a) + at(b)) / 2;
    append_stick(out, at(a), middle, kStickAngstrom * metres_per_angstrom, sides, colors[a]);
    append_stick(out, middle, at(b), kStickAngstrom * metres_per_angstrom, sides, colors[b]);
  }
}

}  // namespace tandem::client

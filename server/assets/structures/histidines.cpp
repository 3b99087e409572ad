// See histidines.hpp.
#include "server/assets/structures/histidines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "server/assets/structures/atom_grid.hpp"
#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {
namespace {

constexpr double kNearAngstrom = 3.5, kStrongAngstrom = 2.5, kMetalAngstrom = 2.8;
constexpr double kMinCosine = 0.5;
constexpr double kMetalWeight = 10;
constexpr double kMinWeight = 0.2;  // weight at a distance of 3.3 Å
constexpr double kMaxHydrogenBondAngstrom = 1.5;

constexpr std::array kAcceptors =
    std::to_array<std::string_view>({"O", "OXT", "OD1", "OD2", "OE1", "OE2", "OP1", "OP2", "O1P", "O2P"});
constexpr std::array kDonors = std::to_array<std::string_view>({"N", "ND2", "NE", "NE1", "NE2", "NH1", "NH2", "NZ"});
constexpr std::array kMetals = std::to_array<std::string_view>(
    {"CA", "CD", "CO", "CU", "FE", "HG", "MG", "MN", "MO", "NI", "PB", "PT", "V", "W", "ZN"});

bool contains(const auto& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// Evidence for (positive) or against (negative) a hydrogen on one nitrogen.
struct Evidence {
  double sum = 0;
  double strongest = 0;
  std::string text;

  void add(double weight, const std::string& what) {
    sum += weight;
    if (std::abs(weight) <= std::abs(strongest)) return;
    strongest = weight;
    text = what;
  }
};

class HistidineChooser {
 public:
  HistidineChooser(const std::vector<PdbResidue>& residues, const std::vector<PdbResidue>& others)
      : grid_(kNearAngstrom, positions_of(residues, others)) {}

  HistidineChoice choose(const PdbResidue& residue) const {
    const PdbAtom *const nd1 = find_atom(residue, "ND1"), *const ne2 = find_atom(residue, "NE2");
    const PdbAtom *const ce1 = find_atom(residue, "CE1"), *const cg = find_atom(residue, "CG"),
                         *const cd2 = find_atom(residue, "CD2");
    if (nd1 == nullptr || ne2 == nullptr || has_ring_hydrogen(residue, *nd1, *ne2)) return {};
    if (ce1 == nullptr || cg == nullptr || cd2 == nullptr) return {"HISE", "its ring is incomplete"};
    const Evidence delta = evidence(residue, *nd1, *cg, *ce1), epsilon = evidence(residue, *ne2, *cd2, *ce1);
    if (std::max(std::abs(delta.strongest), std::abs(epsilon.strongest)) < kMinWeight)
      return {"HISE", "no atom near its nitrogens decides"};
    const bool is_delta = delta.sum > epsilon.sum;
    const Evidence& stronger = std::abs(delta.strongest) > std::abs(epsilon.strongest) ? delta : epsilon;
    return {is_delta ? "HISD" : "HISE", stronger.text};
  }

 private:
  static bool has_ring_hydrogen(const PdbResidue& residue, const PdbAtom& nd1, const PdbAtom& ne2) {
    return std::ranges::any_of(residue.atoms, [&](const PdbAtom& atom) {
      if (atom.element != "H") return false;
      return (atom.position_angstrom - nd1.position_angstrom).norm() < kMaxHydrogenBondAngstrom ||
             (atom.position_angstrom - ne2.position_angstrom).norm() < kMaxHydrogenBondAngstrom;
    });
  }

  std::vector<Vec3> positions_of(const std::vector<PdbResidue>& residues, const std::vector<PdbResidue>& others) {
    std::vector<Vec3> positions;
    for (const auto* const group : {&residues, &others}) {
      for (const PdbResidue& residue : *group) {
        for (const PdbAtom& atom : residue.atoms) {
          if (atom.element != "N" && atom.element != "O" && !contains(kMetals, atom.element)) continue;
          positions.push_back(atom.position_angstrom);
          atoms_.push_back({&residue, &atom});
        }
      }
    }
    return positions;
  }

  Evidence evidence(const PdbResidue& residue, const PdbAtom& nitrogen, const PdbAtom& a, const PdbAtom& b) const {
    const Vec3 outwards = (2 * nitrogen.position_angstrom - a.position_angstrom - b.position_angstrom).normalized();
    Evidence found;
    grid_.visit_near(nitrogen.position_angstrom, [&](std::size_t i) {
      const auto& [other, atom] = atoms_[i];
      const Vec3 way = atom->position_angstrom - nitrogen.position_angstrom;
      const double distance = way.norm();
      if (other == &residue || distance > kNearAngstrom || way.dot(outwards) < kMinCosine * distance) return;
      const double near = std::min(1.0, (kNearAngstrom - distance) / (kNearAngstrom - kStrongAngstrom));
      double weight = 0;
      if (contains(kMetals, atom->element)) {
        weight = distance <= kMetalAngstrom ? -kMetalWeight : 0;
      } else if (atom->element == "O" && contains(kAcceptors, atom->name) && other->name != "HOH") {
        weight = near;
      } else if (atom->element == "N" && contains(kDonors, atom->name) && !is_histidine(other->name)) {
        weight = -near;
      }
      if (weight == 0) return;
      std::array<char, 16> text{};
      std::snprintf(text.data(), text.size(), "%.1f Å", distance);
      found.add(weight, nitrogen.name + " is " + text.data() + " from " + place_text(*other, atom->name));
    });
    return found;
  }

  struct Neighbour {
    const PdbResidue* residue;
    const PdbAtom* atom;
  };
  std::vector<Neighbour> atoms_;  ///< declared before grid_, because positions_of() fills it to initialise grid_
  AtomGrid grid_;
};

}  // namespace

std::vector<HistidineChoice> choose_histidines(const std::vector<PdbResidue>& residues,
                                               const std::vector<PdbResidue>& others) {
  std::vector<HistidineChoice> choices(residues.size());
  if (std::ranges::none_of(residues, [](const PdbResidue& residue) { return is_histidine(residue.name); }))
    return choices;
  const HistidineChooser chooser(residues, others);
  for (std::size_t r = 0; r < residues.size(); ++r) {
    if (is_histidine(residues[r].name)) choices[r] = chooser.choose(residues[r]);
  }
  return choices;
}

}  // namespace tandem::server

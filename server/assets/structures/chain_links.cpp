// See chain_links.hpp.
#include "server/assets/structures/chain_links.hpp"

#include <algorithm>
#include <charconv>

#include "server/assets/structures/atom_grid.hpp"

namespace tandem::server {
namespace {

constexpr double kMaxLinkAngstrom = 2.0;

/// Positions and residues of all atoms with one name.
struct BondSites {
  std::vector<Vec3> positions;
  std::vector<std::size_t> residues;
};

BondSites sites_of(const std::vector<PdbResidue>& residues, std::string_view name) {
  BondSites sites;
  for (std::size_t r = 0; r < residues.size(); ++r) {
    const PdbAtom* const atom = find_atom(residues[r], name);
    if (atom == nullptr) continue;
    sites.positions.push_back(atom->position_angstrom);
    sites.residues.push_back(r);
  }
  return sites;
}

/// Adds a link from each atom of `sources` to the nearest atom of `targets` that is in another residue and within a
/// bond length. Each target is linked at most once.
void link_nearest(const BondSites& sources, const BondSites& targets, std::vector<ChainLink>& links) {
  const AtomGrid grid(kMaxLinkAngstrom, targets.positions);
  for (std::size_t s = 0; s < sources.residues.size(); ++s) {
    const std::size_t source = sources.residues[s];
    double nearest = kMaxLinkAngstrom;
    std::optional<std::size_t> found;
    grid.visit_near(sources.positions[s], [&](std::size_t t) {
      const std::size_t target = targets.residues[t];
      const double distance = (targets.positions[t] - sources.positions[s]).norm();
      if (distance >= nearest || target == source || links[target].previous) return;
      nearest = distance;
      found = target;
    });
    if (!found) continue;
    links[*found].previous = source;
    links[*found].begins = ChainEnd::kBonded;
    links[source].ends = ChainEnd::kBonded;
  }
}

/// Returns the residue number without the insertion code.
int number_of(const PdbResidue& residue) {
  int number = 0;
  std::from_chars(residue.id.data(), residue.id.data() + residue.id.size(), number);
  return number;
}

/// Returns whether two residues belong to one chain. If a TER record separates them, it marks either the end of a chain
/// or a gap in it. A gap is assumed if the residue numbers continue, with some numbers missing.
bool is_same_chain(const PdbResidue& earlier, const PdbResidue& later) {
  if (earlier.chain != later.chain || find_atom(earlier, "OXT") != nullptr) return false;
  return earlier.segment == later.segment || number_of(later) > number_of(earlier) + 1;
}

bool has_link_atoms(const PdbResidue& earlier, const PdbResidue& later) {
  return (find_atom(earlier, "C") != nullptr || find_atom(earlier, "O3'") != nullptr) &&
         (find_atom(later, "N") != nullptr || find_atom(later, "P") != nullptr);
}

}  // namespace

const PdbAtom* find_atom(const PdbResidue& residue, std::string_view name) {
  const auto found = std::ranges::find(residue.atoms, name, &PdbAtom::name);
  return found == residue.atoms.end() ? nullptr : &*found;
}

std::vector<ChainLink> chain_links(const std::vector<PdbResidue>& residues) {
  std::vector<ChainLink> links(residues.size());
  link_nearest(sites_of(residues, "C"), sites_of(residues, "N"), links);
  link_nearest(sites_of(residues, "O3'"), sites_of(residues, "P"), links);
  for (std::size_t r = 1; r < residues.size(); ++r) {
    const bool is_bonded = links[r].begins == ChainEnd::kBonded || links[r - 1].ends == ChainEnd::kBonded;
    if (is_bonded || !is_same_chain(residues[r - 1], residues[r])) continue;
    const bool is_known = has_link_atoms(residues[r - 1], residues[r]);
    links[r].begins = links[r - 1].ends = is_known ? ChainEnd::kGap : ChainEnd::kBonded;
    if (!is_known) links[r].previous = r - 1;
  }
  return links;
}

}  // namespace tandem::server

#include "client/view/molecule/residue_selection.hpp"

#include <algorithm>

#include "client/view/molecule/residue_range.hpp"

namespace tandem::client {
namespace {

bool has_residues(const docking::Molecule& molecule) {
  const std::size_t size = molecule.size();
  return molecule.residue_ids.size() == size && molecule.chains.size() == size &&
         molecule.residue_names.size() == size && molecule.segments.size() == size;
}

/// Returns true if two atoms belong to the same residue. docking::residue_starts() would give the same result, but at
/// the cost O(atoms).
bool is_same_residue(const docking::Molecule& molecule, std::size_t a, std::size_t b) {
  return has_residues(molecule) && molecule.residue_ids[a] == molecule.residue_ids[b] &&
         molecule.residue_names[a] == molecule.residue_names[b] && molecule.chains[a] == molecule.chains[b] &&
         molecule.segments[a] == molecule.segments[b];
}

/// Returns the names of the chains of all molecules as text: "A, B".
std::string chains_of(const DrawnScene& scene) {
  std::set<std::string> names;
  for (const DrawnBody& body : scene.bodies) {
    if (body.molecule != nullptr) names.insert(body.molecule->chains.begin(), body.molecule->chains.end());
  }
  std::string text;
  for (const std::string& name : names) {
    if (text.size() < 40) text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

}  // namespace

std::size_t residue_start(const docking::Molecule& molecule, std::size_t atom) {
  while (atom > 0 && is_same_residue(molecule, atom - 1, atom)) --atom;
  return atom;
}

std::size_t residue_end(const docking::Molecule& molecule, std::size_t start) {
  std::size_t end = start + 1;
  while (end < molecule.size() && is_same_residue(molecule, start, end)) ++end;
  return std::min(end, molecule.size());
}

void ResidueSelection::belong_to(const std::string& molecules) {
  if (molecules != molecules_) clear();
  molecules_ = molecules;
}

void ResidueSelection::clear() {
  residues_.clear();
  picked_.clear();
}

void ResidueSelection::click(const DrawnScene& scene, const AtomPlace& place) {
  const docking::Molecule* const molecule = molecule_at(scene, place);
  if (molecule == nullptr) return;
  const AtomPlace residue{place.body, residue_start(*molecule, place.atom)};
  if (std::erase(picked_, place) > 0) {
    residues_.erase(residue);
    return;
  }
  if (picked_.size() == 2) picked_.erase(picked_.begin());
  picked_.push_back(place);
  if (residues_.size() < kMaxResidues) residues_.insert(residue);
}

std::string ResidueSelection::select(const DrawnScene& scene, std::string_view text) {
  const auto ranges = parse_residues(text);
  if (!ranges) return "Write a range such as A:10-25, one residue as A:12, or A: for a whole chain.";
  std::set<AtomPlace> found;
  for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
    const docking::Molecule* const molecule = scene.bodies[body].molecule.get();
    if (molecule == nullptr || !has_residues(*molecule)) continue;
    for (std::size_t start = 0; start < molecule->size(); start = residue_end(*molecule, start)) {
      const auto is_wanted = [&](const ResidueRange& range) {
        return is_in(range, molecule->chains[start], molecule->residue_ids[start]);
      };
      if (found.size() < kMaxResidues && std::ranges::any_of(*ranges, is_wanted)) found.insert({body, start});
    }
  }
  if (found.empty()) return "No residue is " + std::string(text) + ". The chains are " + chains_of(scene) + ".";
  residues_ = std::move(found);
  picked_.clear();  // the picked atoms may not be in the new selection
  return "";
}

std::optional<AtomDistance> ResidueSelection::distance(const DrawnScene& scene, std::span<const Pose> X_WB,
                                                       double metres_per_angstrom) const {
  if (picked_.size() != 2) return std::nullopt;
  std::vector<Vec3> at_W;
  for (const AtomPlace& place : picked_) {
    const docking::Molecule* const molecule = molecule_at(scene, place);
    if (molecule == nullptr || place.body >= X_WB.size()) return std::nullopt;
    at_W.push_back(X_WB[place.body] * Vec3(metres_per_angstrom * molecule->positions_angstrom[place.atom]));
  }
  return AtomDistance{.from_W = at_W[0], .to_W = at_W[1], .angstrom = (at_W[1] - at_W[0]).norm() / metres_per_angstrom};
}

}  // namespace tandem::client

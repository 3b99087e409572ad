// See hydrogens.hpp.
#include "server/assets/structures/hydrogens.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/assets/structures/hydrogen_geometry.hpp"

namespace tandem::server {
namespace {

constexpr double kCarboxylateAngstrom = 1.25;

AtomPlaces places_of(const PdbResidue& residue, const TypedResidue& typed) {
  AtomPlaces found;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    found.emplace(typed.names[i], residue.atoms[i].position_angstrom);
  }
  return found;
}

/// Returns the atoms of the previous residue. If the residue begins after a gap, the result contains only the missing
/// carbon, at a computed position.
std::optional<AtomPlaces> places_before(const ForceField& force_field, const std::vector<PdbResidue>& residues,
                                        std::span<const ResidueContext> contexts, std::size_t r,
                                        const AtomPlaces& own) {
  if (const auto previous = contexts[r].previous) {
    return places_of(residues[*previous], type_residue(force_field, residues[*previous], contexts[*previous]));
  }
  if (contexts[r].begins != ChainEnd::kGap) return std::nullopt;
  const auto carbon = carbon_before_gap(own);
  return carbon ? std::optional(AtomPlaces{{"C", *carbon}}) : std::nullopt;
}

/// Makes the group of a rule. Its rotation axis is the bond between the rule's first two atoms.
BuiltGroup group_of(const HydrogenRule& rule, const AtomPlaces& own) {
  BuiltGroup group;
  group.carrier_angstrom = own.find(rule.anchors.front())->second;
  const auto axis = own.find(rule.anchors[1]);
  if (!turns(rule, own) || axis == own.end()) return group;
  group.turns = true;
  group.axis_angstrom = axis->second;
  return group;
}

/// Adds the hydrogens of all rules of a residue, except rules whose hydrogens are all present. Returns the added
/// groups, in which the caller must set the residue index.
std::vector<BuiltGroup> add_hydrogens(PdbResidue& residue, const TypedResidue& typed, const AtomPlaces& own,
                                      const AtomPlaces* before) {
  std::vector<BuiltGroup> groups;
  std::set<std::string> removed;
  std::vector<PdbAtom> made;
  for (const HydrogenRule& rule : typed.rules) {
    bool is_complete = true;
    for (int n = 0; n < rule.count; ++n) is_complete &= own.contains(rule.hydrogen(n));
    if (is_complete) continue;
    const std::vector<Vec3> places = hydrogen_places(rule, own, before);
    if (!places.empty()) groups.push_back(group_of(rule, own));
    for (std::size_t n = 0; n < places.size(); ++n) {
      PdbAtom atom;
      atom.name = rule.hydrogen(static_cast<int>(n));
      atom.element = "H";
      atom.position_angstrom = places[n];
      removed.insert(atom.name);
      groups.back().names.push_back(atom.name);
      made.push_back(std::move(atom));
    }
  }
  // If some hydrogens of a group are missing, all hydrogens of the group are built again, because their positions
  // depend on each other.
  std::vector<PdbAtom> kept;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    if (!removed.contains(typed.names[i])) kept.push_back(std::move(residue.atoms[i]));
  }
  residue.atoms = std::move(kept);
  for (PdbAtom& atom : made) residue.atoms.push_back(std::move(atom));
  return groups;
}

const char* united_type(const HydrogenRule& rule) {
  if (rule.kind == 1) return "opls_011";  // aromatic, in a ring
  const bool is_alpha = rule.anchors.front() == "CA";
  if (rule.count == 1) return is_alpha ? "opls_006" : "opls_008";
  if (rule.count == 2) return is_alpha ? "opls_005" : "opls_009";
  return "opls_010";
}

}  // namespace

Hydrogens hydrogens_of(const std::string& text) {
  if (text == "given") return Hydrogens::kGiven;
  if (text == "build") return Hydrogens::kBuild;
  if (text == "united") return Hydrogens::kUnited;
  if (text.empty()) return Hydrogens::kAsNeeded;
  throw std::invalid_argument("hydrogens \"" + text + "\" must be given, build or united");
}

std::string text_of(Hydrogens hydrogens) {
  switch (hydrogens) {
    case Hydrogens::kGiven:
      return "given";
    case Hydrogens::kBuild:
      return "build";
    case Hydrogens::kUnited:
      return "united";
    default:
      return {};
  }
}

bool complete_chain_end(const ForceField& force_field, PdbResidue& residue) {
  const PdbAtom *const ca = find_atom(residue, "CA"), *const c = find_atom(residue, "C"),
                       *const o = find_atom(residue, "O");
  if (!is_amino_acid(force_field, residue.name) || has_own_charges(residue)) return false;
  if (find_atom(residue, "OXT") != nullptr) return false;
  if (ca == nullptr || c == nullptr || o == nullptr) return false;
  const Vec3 inwards = (ca->position_angstrom - c->position_angstrom).normalized() +
                       (o->position_angstrom - c->position_angstrom).normalized();
  constexpr double kMinOfALine = 0.1;  // below this length, CA, C and O are nearly collinear and define no direction
  if (!(inwards.norm() > kMinOfALine)) return false;
  PdbAtom atom;
  atom.name = "OXT";
  atom.element = "O";
  atom.position_angstrom = c->position_angstrom - kCarboxylateAngstrom * inwards.normalized();
  residue.atoms.push_back(std::move(atom));
  return true;
}

std::vector<BuiltGroup> complete_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                           std::span<const ResidueContext> contexts, std::size_t r) {
  PdbResidue& residue = residues[r];
  const TypedResidue typed = type_residue(force_field, residue, contexts[r]);
  const AtomPlaces own = places_of(residue, typed);
  const auto before = places_before(force_field, residues, contexts, r, own);
  std::vector<BuiltGroup> groups = add_hydrogens(residue, typed, own, before ? &*before : nullptr);
  for (BuiltGroup& group : groups) group.residue = r;
  return groups;
}

std::vector<BuiltGroup> build_hydrogens(const ForceField& force_field, std::vector<PdbResidue>& residues,
                                        std::span<const ResidueContext> contexts) {
  for (PdbResidue& residue : residues) {
    if (has_own_charges(residue)) continue;
    std::erase_if(residue.atoms, [](const PdbAtom& atom) { return atom.element == "H"; });
  }
  std::vector<BuiltGroup> groups;
  for (std::size_t r = 0; r < residues.size(); ++r) {
    if (has_own_charges(residues[r])) continue;
    for (BuiltGroup& group : complete_hydrogens(force_field, residues, contexts, r)) groups.push_back(std::move(group));
  }
  return groups;
}

void unite_hydrogens(const ForceField& force_field, PdbResidue& residue, TypedResidue& typed) {
  std::vector<bool> is_merged(residue.atoms.size(), false);
  const auto index_of = [&typed](const std::string& name) {
    return static_cast<std::size_t>(std::find(typed.names.begin(), typed.names.end(), name) - typed.names.begin());
  };
  for (const HydrogenRule& rule : typed.rules) {
    const std::size_t carbon = index_of(rule.anchors.front());
    if (carbon >= residue.atoms.size() || residue.atoms[carbon].element != "C") continue;
    if (force_field.types.find(united_type(rule)) == force_field.types.end()) continue;
    for (int n = 0; n < rule.count; ++n) {
      const std::size_t hydrogen = index_of(rule.hydrogen(n));
      if (hydrogen >= residue.atoms.size()) continue;
      typed.atoms[carbon].charge_e += typed.atoms[hydrogen].charge_e;
      typed.atoms[carbon].type = united_type(rule);
      is_merged[hydrogen] = true;
    }
  }
  for (std::size_t i = residue.atoms.size(); i-- > 0;) {
    if (!is_merged[i]) continue;
    const auto at = static_cast<std::ptrdiff_t>(i);
    residue.atoms.erase(residue.atoms.begin() + at);
    typed.atoms.erase(typed.atoms.begin() + at);
    typed.guesses.erase(typed.guesses.begin() + at);
    typed.names.erase(typed.names.begin() + at);
  }
}

}  // namespace tandem::server

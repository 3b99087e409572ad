// See residue_typing.hpp.
#include "server/assets/structures/residue_typing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "server/assets/structures/hydrogen_geometry.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

/// Substitute type for each element: the entries of alkanes, amides and sulfides in OPLS-AA. Selenium of MSE counts as
/// sulfur. Zinc and iron count as magnesium, because their ions are of similar size.
struct ElementType {
  std::string_view element;
  std::string_view type;
};
constexpr std::array<ElementType, 16> kTypeOfElement = {{{"C", "opls_135"},
                                                         {"N", "opls_238"},
                                                         {"O", "opls_236"},
                                                         {"S", "opls_202"},
                                                         {"SE", "opls_202"},
                                                         {"P", "opls_393"},
                                                         {"H", "opls_140"},
                                                         {"F", "opls_164"},
                                                         {"CL", "opls_151"},
                                                         {"BR", "opls_722"},
                                                         {"NA", "opls_407"},
                                                         {"K", "opls_408"},
                                                         {"MG", "opls_411"},
                                                         {"ZN", "opls_411"},
                                                         {"FE", "opls_411"},
                                                         {"CA", "opls_412"}}};
constexpr std::string_view kPolarHydrogen = "opls_241";

constexpr double kDisulfideAngstrom = 2.0;
constexpr double kDisulfideTolerance = 0.1;
// Limit of the number of cysteines, because all pairs of them may have to be compared. It is ample: the shell of a
// virus with 60 proteins has a few hundred.
constexpr std::size_t kMaxCysteines = 20'000;

std::string_view stem(std::string_view name) {
  while (!name.empty() && is_digit(name.back())) name.remove_suffix(1);
  return name;
}

std::string_view without_last_digit(std::string_view name) {
  if (!name.empty() && is_digit(name.back())) name.remove_suffix(1);
  return name;
}

bool alike(const BlockAtom& a, const BlockAtom& b) {
  return a.type == b.type && std::abs(a.charge_e - b.charge_e) < 1e-9;
}

/// Finds the block atom of each atom in the file, if there is one. (A block is the force field's entry for a residue.)
/// Each block atom is used once. Hydrogens are matched by their heavy atom, under any name. If hydrogens of one heavy
/// atom have other names than in the block, each is matched with the block atom whose position by the hydrogen rules is
/// nearest.
class Matcher {
 public:
  Matcher(const Composition& block, const PdbResidue& residue, const NamedAtoms& named)
      : atoms_(block.atoms), residue_(residue), named_(named), used_(atoms_.size(), false), match_(named.names.size()) {
    find_places(block.rules);
    for (std::size_t i = 0; i < match_.size(); ++i) match_by_name(i);
    for (std::size_t i = 0; i < match_.size(); ++i) {
      if (!match_[i] && is_hydrogen(i)) match_on_carrier(i);
    }
    for (const auto key : {without_last_digit, stem}) {
      for (std::size_t i = 0; i < match_.size(); ++i) {
        if (!match_[i] && is_hydrogen(i)) match_stem(i, key);
      }
    }
  }

  const BlockAtom* match_of(std::size_t i) const { return match_[i] ? &atoms_[*match_[i]] : nullptr; }
  bool is_used(std::size_t block_atom) const { return used_[block_atom]; }
  /// Returns whether a hydrogen does not fit the block: it has no heavy atom in the residue, or its heavy atom already
  /// has all hydrogens of the block.
  bool is_misfit(std::size_t i) const {
    if (match_[i] || !is_hydrogen(i)) return false;
    return named_.carriers[i] == NamedAtoms::kNowhere || match_[named_.carriers[i]].has_value();
  }

 private:
  bool is_hydrogen(std::size_t i) const { return residue_.atoms[i].element == "H"; }

  /// Finds the carrier and the position of each block atom that a rule adds.
  void find_places(const std::vector<HydrogenRule>& rules) {
    for (std::size_t i = 0; i < match_.size(); ++i) own_.emplace(named_.names[i], residue_.atoms[i].position_angstrom);
    carrier_.resize(atoms_.size());
    places_.resize(atoms_.size());
    for (const HydrogenRule& rule : rules) {
      const std::vector<Vec3> places = hydrogen_places(rule, own_, nullptr);
      for (int n = 0; n < rule.count; ++n) {
        const auto k =
            static_cast<std::size_t>(std::ranges::find(atoms_, rule.hydrogen(n), &BlockAtom::name) - atoms_.begin());
        if (k == atoms_.size()) continue;
        carrier_[k] = rule.anchors.front();
        if (static_cast<std::size_t>(n) < places.size()) places_[k] = places[static_cast<std::size_t>(n)];
      }
    }
  }

  std::string_view carrier_name(std::size_t i) const {
    return named_.carriers[i] == NamedAtoms::kNowhere ? std::string_view()
                                                      : std::string_view(named_.names[named_.carriers[i]]);
  }

  /// Returns whether a hydrogen is bonded to `carrier`. In a crowded structure, this may be true although another heavy
  /// atom is nearer.
  bool is_on(std::size_t hydrogen, const std::string& carrier) const {
    constexpr double kMaxCrowdedAngstrom = 1.15;
    if (carrier == carrier_name(hydrogen)) return true;
    const auto place = own_.find(carrier);
    return place != own_.end() &&
           (place->second - residue_.atoms[hydrogen].position_angstrom).norm() < kMaxCrowdedAngstrom;
  }

  void match_by_name(std::size_t i) {
    for (std::size_t k = 0; k < atoms_.size(); ++k) {
      if (used_[k] || atoms_[k].name != named_.names[i]) continue;
      if (is_hydrogen(i) && !carrier_[k].empty() && !is_on(i, carrier_[k])) continue;
      return assign(i, k);
    }
  }

  void match_on_carrier(std::size_t i) {
    if (carrier_name(i).empty()) return;
    std::optional<std::size_t> best;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < atoms_.size(); ++k) {
      if (used_[k] || carrier_[k] != carrier_name(i)) continue;
      const double distance = places_[k] ? (*places_[k] - residue_.atoms[i].position_angstrom).norm() : 0;
      if (distance >= nearest) continue;
      nearest = distance;
      best = k;
    }
    if (best) assign(i, *best);
  }

  /// Matches a hydrogen for whose heavy atom there is no rule, with an unused and equivalent block atom. For example,
  /// HG13 is matched with HG11 if HG11 is unused.
  void match_stem(std::size_t i, std::string_view (*key)(std::string_view)) {
    std::optional<std::size_t> spare;
    const BlockAtom* first = nullptr;
    for (std::size_t k = 0; k < atoms_.size(); ++k) {
      if (!carrier_[k].empty() || atoms_[k].name.front() != 'H' || key(atoms_[k].name) != key(named_.names[i]))
        continue;
      if (first == nullptr) first = &atoms_[k];
      if (!alike(*first, atoms_[k])) return;
      if (!used_[k] && !spare) spare = k;
    }
    if (spare) assign(i, *spare);
  }

  void assign(std::size_t i, std::size_t k) {
    used_[k] = true;
    match_[i] = k;
  }

  const std::vector<BlockAtom>& atoms_;
  const PdbResidue& residue_;
  const NamedAtoms& named_;
  AtomPlaces own_;
  std::vector<std::string> carrier_;               ///< heavy atom of each block atom; empty if no rule adds the atom
  std::vector<std::optional<Vec3>> places_;        ///< positions by the hydrogen rules, indexed by block atom
  std::vector<bool> used_;                         ///< indexed by block atom
  std::vector<std::optional<std::size_t>> match_;  ///< indexed by file atom
};

bool is_bound_to_carbon(const PdbResidue& residue, std::size_t hydrogen) {
  double nearest = std::numeric_limits<double>::infinity();
  bool carbon = true;
  for (const PdbAtom& atom : residue.atoms) {
    if (atom.element == "H") continue;
    const double distance = (atom.position_angstrom - residue.atoms[hydrogen].position_angstrom).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      carbon = atom.element == "C";
    }
  }
  return carbon;
}

/// Returns whether the name is that of the second oxygen of a chain end. AMBER's force fields call the two oxygens OC1
/// and OC2.
bool is_second_oxygen(std::string_view name) {
  return name == "OXT" || name == "OC1";
}

/// Returns the atom type that is used for an element without an entry. An unknown element counts as carbon, whose size
/// is typical of the atoms of a protein.
std::string stand_in(const ForceField& force_field, const std::string& element, bool is_polar_hydrogen) {
  const bool is_opls = force_field.name == kOplsName;
  if (is_polar_hydrogen && is_opls) return std::string(kPolarHydrogen);
  if (is_opls) {
    const auto* const own = std::ranges::find(kTypeOfElement, element, &ElementType::element);
    if (own != kTypeOfElement.end()) return std::string(own->type);
  }
  const std::string prefix(force_field.is_by_element ? std::string_view() : kElementPrefix);
  const std::string type = prefix + (is_polar_hydrogen ? "HP" : element);
  if (force_field.types.contains(type)) return type;
  return is_opls ? "opls_135" : prefix + "C";
}

/// Gives the last atom of `typed`, a selenium in place of sulfur, the type of selenium. It keeps the charge of the
/// sulfur entry.
void match_selenium(const ForceField& force_field, TypedResidue& typed) {
  const std::string type = std::string(kElementPrefix) + "SE";
  if (force_field.types.contains(type)) typed.atoms.back().type = type;
}

/// Adds an entry for atom i by its element, and an explanation for the user.
void guess_by_element(const ForceField& force_field, const PdbResidue& residue, std::size_t i, const std::string& block,
                      TypedResidue& typed) {
  const PdbAtom& atom = residue.atoms[i];
  const bool is_polar_hydrogen = atom.element == "H" && !is_bound_to_carbon(residue, i);
  if (force_field.is_by_element && force_field.types.contains(atom.element)) {
    typed.atoms.push_back({atom.name, is_polar_hydrogen ? "HP" : atom.element, 0.0});
    typed.guesses.emplace_back();
    return;
  }
  const std::string type = stand_in(force_field, atom.element, is_polar_hydrogen);
  typed.atoms.push_back({atom.name, type, 0.0});
  typed.guesses.push_back("atom " + place_text(residue, atom.name) + ": not in the force field" +
                          (block.empty() ? "" : "'s block " + block) + ", taken as " + type + " by its element with " +
                          (atom.charge_e ? "the file's charge" : "charge 0"));
}

/// Marks entries that depend on the tautomer of a histidine as guesses. The tautomer is guessed if the file has no
/// hydrogens on the ring.
void mark_guessed_tautomer(const ForceField& force_field, const PdbResidue& residue, const NamedAtoms& named,
                           const ResidueContext& context, TypedResidue& typed) {
  const bool is_delta = context.histidine == "HISD";
  const ResidueBlock* other = block_named(force_field, is_delta ? "HISE" : "HISD");
  if (canonical_residue(residue.name) != "HIS" || named.hydrogens_on("ND1") + named.hydrogens_on("NE2") > 0) return;
  if (other == nullptr || context.histidine == "HISH") return;
  for (std::size_t i = 0; i < named.names.size(); ++i) {
    const BlockAtom* alternative = other->find(named.names[i]);
    std::string& guess = typed.guesses[i];
    if (!guess.empty() || alternative == nullptr || alike(*alternative, typed.atoms[i])) continue;
    guess = "atom " + place_text(residue, residue.atoms[i].name) + ": neither HD1 nor HE2 in the file, taken as " +
            (is_delta ? "HISD, neutral with the hydrogen on ND1" : "HISE, neutral with the hydrogen on NE2");
  }
}

}  // namespace

TypedResidue type_residue(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context) {
  NamedAtoms named = named_atoms(force_field, residue, context);
  const ResidueBlock& block = choose_block(force_field, residue.name, context, named);
  const Composition composition = block_with_ends(force_field, block, context, named);
  const std::vector<BlockAtom>& atoms = composition.atoms;
  const Matcher matcher(composition, residue, named);
  TypedResidue typed;
  typed.rules = composition.rules;
  typed.expected_charge_e = 0;
  for (const BlockAtom& atom : atoms) *typed.expected_charge_e += atom.charge_e;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    if (matcher.is_misfit(i)) typed.misfits.push_back(i);
    if (const BlockAtom* entry = matcher.match_of(i)) {
      typed.atoms.push_back(*entry);
      typed.guesses.emplace_back();
      if (residue.atoms[i].element == "SE") match_selenium(force_field, typed);
      if (residue.atoms[i].element == "H") named.names[i] = entry->name;
    } else {
      guess_by_element(force_field, residue, i, block.name, typed);
    }
  }
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    const bool hydrogen = atoms[k].name.starts_with('H');
    if (hydrogen) ++typed.expected_hydrogens;
    if (matcher.is_used(k)) continue;
    if (hydrogen) {
      ++typed.missing_hydrogens;
      typed.missing_hydrogen_names.push_back(atoms[k].name);
    } else {
      typed.missing_heavy.push_back(atoms[k].name);
    }
  }
  if (context.ends == ChainEnd::kEnd && block.is_amino_acid() && std::ranges::none_of(named.names, is_second_oxygen)) {
    typed.missing_heavy.emplace_back("OXT");
  }
  mark_guessed_tautomer(force_field, residue, named, context, typed);
  typed.names = std::move(named.names);
  return typed;
}

std::optional<double> make_whole(const PdbResidue& residue, TypedResidue& typed) {
  const auto is_of_side_chain = [](const std::string& name) { return name != "OXT" && name != "O"; };
  if (std::ranges::none_of(typed.missing_heavy, is_of_side_chain) || residue.atoms.empty()) return std::nullopt;
  static constexpr std::array kBackbone = std::to_array<std::string_view>({"N", "H", "CA", "HA", "C", "O"});
  double charge_e = 0, count = 0;
  const auto is_backbone = [&typed](std::size_t i) {
    return std::ranges::find(kBackbone, typed.names[i]) != kBackbone.end();
  };
  for (std::size_t i = 0; i < typed.atoms.size(); ++i) {
    charge_e += typed.atoms[i].charge_e;
    if (!is_backbone(i)) ++count;
  }
  const double whole_e = std::round(charge_e);
  const bool shifts_all = count == 0;
  const double shift_e = (whole_e - charge_e) / (shifts_all ? static_cast<double>(typed.atoms.size()) : count);
  for (std::size_t i = 0; i < typed.atoms.size(); ++i) {
    if (shifts_all || !is_backbone(i)) typed.atoms[i].charge_e += shift_e;
  }
  return whole_e;
}

TypedResidue type_by_element(const ForceField& force_field, const PdbResidue& residue) {
  TypedResidue typed;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    guess_by_element(force_field, residue, i, "", typed);
    typed.names.push_back(residue.atoms[i].name);
  }
  return typed;
}

std::vector<bool> find_disulfides(const std::vector<PdbResidue>& residues) {
  struct Sulfur {
    Vec3 position;
    std::size_t residue;
  };
  std::vector<Sulfur> sulfurs;
  for (std::size_t r = 0; r < residues.size(); ++r) {
    if (!canonical_residue(residues[r].name).starts_with("CY")) continue;
    for (const PdbAtom& atom : residues[r].atoms) {
      if (atom.name == "SG") sulfurs.push_back({atom.position_angstrom, r});
    }
  }
  if (sulfurs.size() > kMaxCysteines) {
    throw docking::MoleculeError(std::to_string(sulfurs.size()) + " cysteines; at most " +
                                 std::to_string(kMaxCysteines) + " are possible: keep only the chains that are needed");
  }
  // The sulfurs are sorted along x, so that only neighbours in x are compared.
  std::sort(sulfurs.begin(), sulfurs.end(),
            [](const Sulfur& a, const Sulfur& b) { return a.position.x() < b.position.x(); });
  std::vector<bool> bonded(residues.size(), false);
  constexpr double kLongest = kDisulfideAngstrom * (1 + kDisulfideTolerance);
  constexpr double kShortest = kDisulfideAngstrom * (1 - kDisulfideTolerance);
  for (std::size_t i = 0; i < sulfurs.size(); ++i) {
    for (std::size_t j = i + 1; j < sulfurs.size(); ++j) {
      if (sulfurs[j].position.x() - sulfurs[i].position.x() > kLongest) break;
      const double distance = (sulfurs[j].position - sulfurs[i].position).norm();
      if (distance < kShortest || distance > kLongest) continue;
      bonded[sulfurs[i].residue] = true;
      bonded[sulfurs[j].residue] = true;
    }
  }
  return bonded;
}

}  // namespace tandem::server

// See residue_typing.hpp.
#include "server/assets/structures/residue_typing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

struct Renaming {
  std::string_view residue;
  std::string_view from;
  std::string_view to;
};

/// Residue names of other programs (AMBER, CHARMM, GROMOS, PDB components) with one meaning in GROMACS's blocks.
constexpr std::array<std::pair<std::string_view, std::string_view>, 20> kResidueNames = {{
    {"HID", "HISD"},  {"HSD", "HISD"}, {"HISA", "HISD"}, {"HIE", "HISE"}, {"HSE", "HISE"},
    {"HISB", "HISE"}, {"HIP", "HISH"}, {"HSP", "HISH"},  {"CYX", "CYS2"}, {"ASH", "ASPH"},
    {"ASPP", "ASPH"}, {"GLH", "GLUH"}, {"GLUP", "GLUH"}, {"LYN", "LYSN"}, {"LSN", "LYSN"},
    {"LYP", "LYSH"},  {"NME", "NAC"},  {"CT3", "NAC"},   {"PCA", "PGLU"}, {"MSE", "MET"},
}};

/// Atom names of the PDB's chemical components for the caps, which xlateat.dat does not have. By block.
constexpr std::array<Renaming, 12> kCapAtoms = {{
    {"ACE", "H", "HH31"},
    {"ACE", "H1", "HH31"},
    {"ACE", "H2", "HH32"},
    {"ACE", "H3", "HH33"},
    {"NAC", "C", "CH3"},
    {"NAC", "H1", "HH31"},
    {"NAC", "H2", "HH32"},
    {"NAC", "H3", "HH33"},
    {"NAC", "HN2", "H"},
    {"NH2", "HN1", "H1"},
    {"NH2", "HN2", "H2"},
    {"PGLU", "OE1", "OE"},
}};

constexpr std::array<std::string_view, 5> kCaps = {"ACE", "NAC", "NME", "NH2", "NHE"};

/// Stand-ins by element: the alkane, amide and sulfide entries of OPLS-AA. Selenium of MSE is taken as sulfur, zinc and iron
/// as magnesium, whose ions are as small.
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
// Each may have to be compared with each. A virus's shell of 60 proteins has some hundred.
constexpr std::size_t kMaxCysteines = 20'000;

using Names = std::vector<std::string>;

bool has(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string_view stem(std::string_view name) {
  while (!name.empty() && is_digit(name.back())) name.remove_suffix(1);
  return name;
}

std::string_view without_last_digit(std::string_view name) {
  if (!name.empty() && is_digit(name.back())) name.remove_suffix(1);
  return name;
}

std::string_view canonical_residue(std::string_view name) {
  for (const auto& [other, canonical] : kResidueNames) {
    if (other == name) return canonical;
  }
  return name;
}

/// The block of a residue as GROMACS names it: "HISE" is HIE in AMBER's force fields, HSE in CHARMM's.
const ResidueBlock* block_named(const ForceField& force_field, std::string_view residue) {
  const auto renamed = force_field.block_of_residue.find(residue);
  const ResidueBlock* const block =
      force_field.block(renamed == force_field.block_of_residue.end() ? residue : renamed->second);
  return block == nullptr && residue == "NAC" ? force_field.block("NME") : block;
}

/// Block name without regard to protonation; "HIS" has none of its own.
const ResidueBlock* default_block(const ForceField& force_field, std::string_view residue_name) {
  const std::string_view canonical = canonical_residue(residue_name);
  return block_named(force_field, canonical == "HIS" ? "HISE" : canonical);
}

std::string digit_last(std::string_view name) {
  std::size_t digits = 0;
  while (digits < name.size() && is_digit(name[digits])) ++digits;
  return std::string(name.substr(digits)) + std::string(name.substr(0, digits));
}

bool alias_applies(const AtomAlias& alias, std::string_view residue_name, const ResidueContext& context) {
  return alias.residue == "protein" || alias.residue == residue_name ||
         (alias.residue == "protein-nterm" && context.first_of_chain) ||
         (alias.residue == "protein-cterm" && context.last_of_chain);
}

Names normalised_names(const ForceField& force_field, const PdbResidue& residue, const ResidueBlock& block,
                       const ResidueContext& context) {
  Names names;
  for (const PdbAtom& atom : residue.atoms) {
    std::string name = digit_last(atom.name);
    for (const AtomAlias& alias : force_field.aliases) {
      if (alias.from == name && alias_applies(alias, residue.name, context)) {
        name = alias.to;
        break;
      }
    }
    for (const Renaming& cap : kCapAtoms) {
      if (cap.residue == (block.name == "NME" ? "NAC" : block.name) && cap.from == name) {
        name = cap.to;
        break;
      }
    }
    names.push_back(std::move(name));
  }
  return names;
}

void swap_names(Names& names, std::string_view a, std::string_view b) {
  for (std::string& name : names) {
    if (name == a) {
      name = b;
    } else if (name == b) {
      name = a;
    }
  }
}

/// The block of a protonated acid has its hydrogen on the second oxygen; a file may have it on the first.
std::string_view acid_block(Names& names, char position, std::string_view charged, std::string_view neutral) {
  const std::string first = std::string("H") + position + "1";
  const std::string second = std::string("H") + position + "2";
  if (has(names, second)) return neutral;
  if (!has(names, first)) return charged;
  swap_names(names, first, second);
  swap_names(names, std::string("O") + position + "1", std::string("O") + position + "2");
  return neutral;
}

std::string_view histidine_block(const Names& names) {
  if (has(names, "HD1")) return has(names, "HE2") ? "HISH" : "HISD";
  return "HISE";
}

const ResidueBlock* choose_block(const ForceField& force_field, std::string_view residue_name,
                                 const ResidueContext& context, Names& names) {
  const std::string_view canonical = canonical_residue(residue_name);
  const ResidueBlock* chosen = nullptr;
  if (canonical == "HIS") chosen = block_named(force_field, histidine_block(names));
  if (canonical == "ASP" || canonical == "ASPH")
    chosen = block_named(force_field, acid_block(names, 'D', canonical, "ASPH"));
  if (canonical == "GLU" || canonical == "GLUH")
    chosen = block_named(force_field, acid_block(names, 'E', canonical, "GLUH"));
  if (canonical == "CYS" && context.in_disulfide && !has(names, "HG")) chosen = block_named(force_field, "CYS2");
  if (canonical == "LYS" &&
      std::count_if(names.begin(), names.end(), [](const std::string& name) { return stem(name) == "HZ"; }) == 2) {
    chosen = block_named(force_field, "LYSN");
  }
  return chosen != nullptr ? chosen : default_block(force_field, residue_name);
}

/// The entry for this residue's block if there is one ("GLY-NH3+"), else the general one ("NH3+").
const TerminusEdit* find_edit(const std::map<std::string, TerminusEdit, std::less<>>& edits, const std::string& block,
                              const std::string& terminus) {
  auto found = edits.find(block + "-" + terminus);
  if (found == edits.end()) found = edits.find(terminus);
  return found == edits.end() ? nullptr : &found->second;
}

std::string n_terminus(const Names& names, const std::string& block) {
  const auto hydrogens =
      std::count_if(names.begin(), names.end(), [](const std::string& name) { return stem(name) == "H"; });
  if (block == "PGLU") return "NH";
  if (block == "PRO") return hydrogens == 1 ? "NH" : "NH2+";
  // One hydrogen is a chain cut out of a longer one: no edit, except where the block has a terminus of that name.
  if (hydrogens == 1) return "NH";
  return hydrogens == 2 ? "NH2" : "NH3+";
}

void apply_to_atoms(const TerminusEdit& edit, std::vector<BlockAtom>& atoms) {
  const auto put = [&atoms](const BlockAtom& atom) {
    const auto same = std::find_if(atoms.begin(), atoms.end(), [&](const BlockAtom& a) { return a.name == atom.name; });
    if (same == atoms.end()) {
      atoms.push_back(atom);
    } else {
      *same = atom;
    }
  };
  for (const std::string& name : edit.deleted) std::erase_if(atoms, [&](const BlockAtom& a) { return a.name == name; });
  for (const BlockAtom& atom : edit.replaced) put(atom);
  for (const BlockAtom& atom : edit.added) put(atom);
}

/// What a residue is made of, with its chain ends.
struct Composition {
  std::vector<BlockAtom> atoms;
  std::vector<HydrogenRule> rules;

  void apply(const TerminusEdit& edit) {
    apply_to_atoms(edit, atoms);
    for (const std::string& name : edit.deleted) {
      std::erase_if(rules, [&name](const HydrogenRule& rule) { return rule.name == name; });
    }
    rules.insert(rules.end(), edit.hydrogens.begin(), edit.hydrogens.end());
  }
};

/// The block that a charged end has of its own, as AMBER's force fields do ("NALA", "CALA"); of a residue that is both ends the N
/// terminus's. None: no such block.
const ResidueBlock* end_block(const ForceField& force_field, const ResidueBlock& block, const std::string& n_end,
                              const std::string& c_end) {
  const auto found = force_field.end_blocks.find(block.name);
  if (found == force_field.end_blocks.end()) return nullptr;
  if (n_end.ends_with('+')) return force_field.block(found->second.first);
  return c_end == "COO-" ? force_field.block(found->second.second) : nullptr;
}

void use_names_of(const ForceField& force_field, std::string_view block, Names& names) {
  for (std::string& name : names) {
    for (const AtomAlias& alias : force_field.block_aliases) {
      if (alias.from != name || (alias.residue != "*" && alias.residue != block)) continue;
      name = alias.to;
      break;
    }
  }
}

/// A residue that is both ends, both charged, takes the zwitterion's entries.
Composition block_with_ends(const ForceField& force_field, const ResidueBlock& block, const ResidueContext& context,
                            Names& names) {
  const auto made_of = [&](const ResidueBlock& one) {
    const auto rules = force_field.hydrogens.find(one.name);
    return Composition{one.atoms, rules == force_field.hydrogens.end() ? std::vector<HydrogenRule>() : rules->second};
  };
  Composition made = made_of(block);
  if (!block.is_amino_acid()) {
    use_names_of(force_field, block.name, names);
    return made;
  }
  std::string n_end = context.first_of_chain ? n_terminus(names, block.name) : "";
  std::string c_end;
  if (has(names, "OXT")) c_end = has(names, "HXT") || has(names, "HO") ? "COOH" : "COO-";
  if (has(names, "HXT")) {
    // In GROMACS's COOH the hydrogen is HO on O; in PDB files it is HXT on OXT.
    swap_names(names, "O", "OXT");
    swap_names(names, "HXT", "HO");
  }
  const ResidueBlock* const end = end_block(force_field, block, n_end, c_end);
  use_names_of(force_field, end != nullptr ? end->name : block.name, names);
  if (end != nullptr) return made_of(*end);
  if (n_end.ends_with('+') && c_end == "COO-") {
    n_end = "ZWITTERION_" + n_end;
    c_end = "ZWITTERION_" + c_end;
  }
  const TerminusEdit* n_edit = n_end.empty() ? nullptr : find_edit(force_field.n_termini, block.name, n_end);
  const TerminusEdit* c_edit = c_end.empty() ? nullptr : find_edit(force_field.c_termini, block.name, c_end);
  if (n_edit != nullptr) made.apply(*n_edit);
  if (c_edit != nullptr) made.apply(*c_edit);
  return made;
}

bool alike(const BlockAtom& a, const BlockAtom& b) {
  return a.type == b.type && std::abs(a.charge_e - b.charge_e) < 1e-9;
}

/// A block atom for each file atom, or none; each block atom is used once.
class Matcher {
 public:
  Matcher(const std::vector<BlockAtom>& atoms, const PdbResidue& residue, const Names& names)
      : atoms_(atoms), names_(names), used_(atoms.size(), false), match_(names.size()) {
    for (std::size_t i = 0; i < names.size(); ++i) match_by_name(i);
    for (const auto key : {without_last_digit, stem}) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (!match_[i] && residue.atoms[i].element == "H") match_hydrogen(i, key);
      }
    }
  }

  const BlockAtom* of(std::size_t i) const { return match_[i] ? &atoms_[*match_[i]] : nullptr; }
  bool is_used(std::size_t block_atom) const { return used_[block_atom]; }

 private:
  void match_by_name(std::size_t i) {
    for (std::size_t k = 0; k < atoms_.size(); ++k) {
      if (!used_[k] && atoms_[k].name == names_[i]) return take(i, k);
    }
  }

  /// HG13 with HG11 where that is free: on one carbon, or else alike on all carbons of that letter.
  void match_hydrogen(std::size_t i, std::string_view (*key)(std::string_view)) {
    std::optional<std::size_t> spare;
    const BlockAtom* first = nullptr;
    for (std::size_t k = 0; k < atoms_.size(); ++k) {
      if (atoms_[k].name.front() != 'H' || key(atoms_[k].name) != key(names_[i])) continue;
      if (first == nullptr) first = &atoms_[k];
      if (!alike(*first, atoms_[k])) return;
      if (!used_[k] && !spare) spare = k;
    }
    if (spare) take(i, *spare);
  }

  void take(std::size_t i, std::size_t k) {
    used_[k] = true;
    match_[i] = k;
  }

  const std::vector<BlockAtom>& atoms_;
  const Names& names_;
  std::vector<bool> used_;
  std::vector<std::optional<std::size_t>> match_;
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

/// Adds an entry for atom i by its element, and what people are told of it.
void guess_by_element(const ForceField& force_field, const PdbResidue& residue, std::size_t i, const std::string& block,
                      TypedResidue& typed) {
  const PdbAtom& atom = residue.atoms[i];
  const bool is_polar_hydrogen = atom.element == "H" && !is_bound_to_carbon(residue, i);
  if (force_field.is_by_element && force_field.types.contains(atom.element)) {
    typed.atoms.push_back({atom.name, is_polar_hydrogen ? "HP" : atom.element, 0.0});
    typed.guesses.emplace_back();
    return;
  }
  // An unknown element: in a protein a carbon-sized atom is the likeliest.
  std::string type = force_field.is_by_element ? "C" : std::string(kElementPrefix) + "C";
  if (force_field.name == kOplsName) {
    type = "opls_135";
    for (const ElementType& known : kTypeOfElement) {
      if (known.element == atom.element) type = known.type;
    }
    if (is_polar_hydrogen) type = kPolarHydrogen;
  } else if (force_field.types.contains(std::string(kElementPrefix) + atom.element)) {
    type = std::string(kElementPrefix) + (is_polar_hydrogen ? "HP" : atom.element);
  }
  typed.atoms.push_back({atom.name, type, 0.0});
  typed.guesses.push_back("atom " + place_text(residue, atom.name) + ": not in the force field" +
                          (block.empty() ? "" : "'s block " + block) + ", taken as " + type + " by its element with " +
                          (atom.charge_e ? "the file's charge" : "charge 0"));
}

/// Without ring hydrogens the tautomer is a choice: every atom whose entry depends on it is a guess.
void mark_guessed_tautomer(const ForceField& force_field, const PdbResidue& residue, const Names& names,
                           TypedResidue& typed) {
  const ResidueBlock* other = block_named(force_field, "HISD");
  if (canonical_residue(residue.name) != "HIS" || has(names, "HD1") || has(names, "HE2") || other == nullptr) return;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const BlockAtom* alternative = other->find(names[i]);
    std::string& guess = typed.guesses[i];
    if (!guess.empty() || alternative == nullptr || alike(*alternative, typed.atoms[i])) continue;
    guess = "atom " + place_text(residue, residue.atoms[i].name) +
            ": neither HD1 nor HE2 in the file, taken as HISE, neutral with the hydrogen on NE2";
  }
}

}  // namespace

bool is_protein_residue(const ForceField& force_field, std::string_view residue_name) {
  const ResidueBlock* block = default_block(force_field, residue_name);
  if (block == nullptr) return false;
  return block->is_amino_acid() || std::find(kCaps.begin(), kCaps.end(), block->name) != kCaps.end();
}

TypedResidue type_residue(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context) {
  Names names = normalised_names(force_field, residue, *default_block(force_field, residue.name), context);
  const ResidueBlock& block = *choose_block(force_field, residue.name, context, names);
  const Composition composition = block_with_ends(force_field, block, context, names);
  const std::vector<BlockAtom>& atoms = composition.atoms;
  const Matcher matcher(atoms, residue, names);
  TypedResidue typed;
  typed.rules = composition.rules;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
    if (const BlockAtom* entry = matcher.of(i)) {
      typed.atoms.push_back(*entry);
      typed.guesses.emplace_back();
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
  mark_guessed_tautomer(force_field, residue, names, typed);
  typed.names = std::move(names);
  return typed;
}

TypedResidue type_by_element(const ForceField& force_field, const PdbResidue& residue) {
  TypedResidue typed;
  for (std::size_t i = 0; i < residue.atoms.size(); ++i) guess_by_element(force_field, residue, i, "", typed);
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
  // Sorted along x, so that only near ones are compared.
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

// See residue_blocks.hpp. A block is the force field's entry for a residue. An edit changes a block at a chain end.
#include "server/assets/structures/residue_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

struct Renaming {
  std::string_view residue;
  std::string_view from;
  std::string_view to;
};

/// Residue names of other programs (AMBER, CHARMM, GROMOS, PDB components) with the corresponding names of GROMACS's
/// blocks.
constexpr std::array<std::pair<std::string_view, std::string_view>, 20> kResidueNames = {{
    {"HID", "HISD"},  {"HSD", "HISD"}, {"HISA", "HISD"}, {"HIE", "HISE"}, {"HSE", "HISE"},
    {"HISB", "HISE"}, {"HIP", "HISH"}, {"HSP", "HISH"},  {"CYX", "CYS2"}, {"ASH", "ASPH"},
    {"ASPP", "ASPH"}, {"GLH", "GLUH"}, {"GLUP", "GLUH"}, {"LYN", "LYSN"}, {"LSN", "LYSN"},
    {"LYP", "LYSH"},  {"NME", "NAC"},  {"CT3", "NAC"},   {"PCA", "PGLU"}, {"MSE", "MET"},
}};

/// Atom names of caps in the PDB's chemical components, which xlateat.dat lacks. Each entry has the block, the name,
/// and the name in the block.
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

using Names = std::vector<std::string>;

bool has(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the block for a residue name, without regard to protonation. "HIS" does not state the protonation, so it
/// gets the block of HISE.
const ResidueBlock* default_block(const ForceField& force_field, std::string_view residue_name) {
  const std::string_view canonical = canonical_residue(residue_name);
  return block_named(force_field, canonical == "HIS" ? "HISE" : canonical);
}

std::string digit_last(std::string_view name) {
  std::size_t digits = 0;
  while (digits < name.size() && is_digit(name[digits])) ++digits;
  return std::string(name.substr(digits)) + std::string(name.substr(0, digits));
}

/// Returns whether an alias applies to an atom of a residue. Aliases for proteins do not apply to nucleotides: there O2
/// is an atom of a base, whereas in proteins it is an oxygen at a chain end.
bool alias_applies(const AtomAlias& alias, std::string_view residue_name, const ResidueBlock& block,
                   const ResidueContext& context) {
  if (alias.residue.starts_with("protein") && block.is_nucleotide()) return false;
  return alias.residue == "protein" || alias.residue == residue_name ||
         (alias.residue == "protein-nterm" && context.begins != ChainEnd::kBonded) ||
         (alias.residue == "protein-cterm" && context.ends != ChainEnd::kBonded);
}

Names normalised_names(const ForceField& force_field, const PdbResidue& residue, const ResidueBlock& block,
                       const ResidueContext& context) {
  Names names;
  for (const PdbAtom& atom : residue.atoms) {
    std::string name = digit_last(atom.name);
    // In files from before 2007, the atom C7 has the name C5M.
    if (block.is_nucleotide() && name == "C5M" && block.find(name) == nullptr) name = "C7";
    for (const AtomAlias& alias : force_field.aliases) {
      if (alias.from == name && alias_applies(alias, residue.name, block, context)) {
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
    if (residue.name == "MSE" && name == "SE") name = "SD";
    names.push_back(std::move(name));
  }
  return names;
}

double hydrogen_bond_length_angstrom(std::string_view element) {
  if (element == "C") return 1.09;
  if (element == "S") return 1.34;
  return element == "O" ? 0.96 : 1.01;
}

/// Returns for each hydrogen the index of the heavy atom that carries it, or NamedAtoms::kNowhere if no heavy atom is
/// within a bond length. Returns for other atoms their own index. The carrier is the atom whose distance fits its bond
/// length best. It need not be the nearest atom: at the start of a chain, pdb2gmx puts a hydrogen of proline's N at
/// only 0.66 Å from CD.
std::vector<std::size_t> carriers(const PdbResidue& residue) {
  constexpr double kMaxHydrogenBondAngstrom = 1.5;  // an S-H bond has 1.34 Å; the rest allows for inexact structures
  std::vector<std::size_t> found(residue.atoms.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i] = i;
    if (residue.atoms[i].element != "H") continue;
    double least = std::numeric_limits<double>::infinity();
    found[i] = NamedAtoms::kNowhere;
    for (std::size_t k = 0; k < found.size(); ++k) {
      if (residue.atoms[k].element == "H") continue;
      const double distance = (residue.atoms[k].position_angstrom - residue.atoms[i].position_angstrom).norm();
      const double error = std::abs(distance - hydrogen_bond_length_angstrom(residue.atoms[k].element));
      if (distance >= kMaxHydrogenBondAngstrom || error >= least) continue;
      least = error;
      found[i] = k;
    }
  }
  return found;
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

/// Returns the block of a residue with a carboxyl group: `charged` or `neutral`. In the neutral block, the second
/// oxygen of the group carries the hydrogen. If the first oxygen carries it in the file, the names of the oxygens are
/// swapped.
std::string_view acid_block(NamedAtoms& named, char position, std::string_view charged, std::string_view neutral) {
  const std::string first = std::string("O") + position + "1", second = std::string("O") + position + "2";
  if (named.hydrogens_on(second) > 0) return neutral;
  if (named.hydrogens_on(first) == 0) return charged;
  swap_names(named.names, first, second);
  return neutral;
}

std::string_view histidine_block(const NamedAtoms& named, const ResidueContext& context) {
  const bool on_delta = named.hydrogens_on("ND1") > 0, on_epsilon = named.hydrogens_on("NE2") > 0;
  if (on_delta) return on_epsilon ? "HISH" : "HISD";
  return on_epsilon || context.histidine.empty() ? std::string_view("HISE") : std::string_view(context.histidine);
}

/// Returns the edit for this residue's block ("GLY-NH3+") if there is one, otherwise the general edit ("NH3+").
const TerminusEdit* find_edit(const std::map<std::string, TerminusEdit, std::less<>>& edits, const std::string& block,
                              const std::string& terminus) {
  auto found = edits.find(block + "-" + terminus);
  if (found == edits.end()) found = edits.find(terminus);
  return found == edits.end() ? nullptr : &found->second;
}

/// Returns the name of the edit for an N terminus; empty if the amino acid is within a chain.
std::string n_terminus(const NamedAtoms& named, const std::string& block, ChainEnd begins) {
  const std::size_t hydrogens = named.hydrogens_on("N");
  if (begins == ChainEnd::kBonded || (begins == ChainEnd::kGap && hydrogens < 2)) return {};
  if (block == "PGLU") return "NH";
  if (block == "PRO") return hydrogens == 1 ? "NH" : "NH2+";
  // If N has only one hydrogen, the chain was cut out of a longer chain. No edit applies then, unless the block has an
  // edit "NH".
  if (hydrogens == 1) return "NH";
  return hydrogens == 2 ? "NH2" : "NH3+";
}

void apply_to_atoms(const TerminusEdit& edit, std::vector<BlockAtom>& atoms) {
  const auto insert = [&atoms](const BlockAtom& atom) {
    const auto same = std::find_if(atoms.begin(), atoms.end(), [&](const BlockAtom& a) { return a.name == atom.name; });
    if (same == atoms.end()) {
      atoms.push_back(atom);
    } else {
      *same = atom;
    }
  };
  for (const std::string& name : edit.deleted) std::erase_if(atoms, [&](const BlockAtom& a) { return a.name == name; });
  for (const BlockAtom& atom : edit.replaced) insert(atom);
  for (const BlockAtom& atom : edit.added) insert(atom);
}

void apply(const TerminusEdit& edit, Composition& made) {
  apply_to_atoms(edit, made.atoms);
  for (const std::string& name : edit.deleted) {
    std::erase_if(made.rules, [&name](const HydrogenRule& rule) { return rule.name == name; });
  }
  made.rules.insert(made.rules.end(), edit.hydrogens.begin(), edit.hydrogens.end());
}

Composition composition_of(const ForceField& force_field, const ResidueBlock& block) {
  const auto rules = force_field.hydrogens.find(block.name);
  return {block.atoms, rules == force_field.hydrogens.end() ? std::vector<HydrogenRule>() : rules->second};
}

/// Returns the special block of a chain end; null if there is none. AMBER's force fields have such blocks for:
/// * charged ends of amino acids ("NALA", "CALA");
/// * nucleotides without a phosphate, at the 3' end, or both ("DA5", "DA3", "DAN").
/// A residue that is a whole chain gets the block for both ends. If there is none, it gets the block of the N terminus.
const ResidueBlock* end_block(const ForceField& force_field, const ResidueBlock& block, bool is_first, bool is_last) {
  const auto found = force_field.end_blocks.find(block.name);
  if (found == force_field.end_blocks.end() || (!is_first && !is_last)) return nullptr;
  const EndBlocks& ends = found->second;
  if (is_first && is_last && !ends.both.empty()) return force_field.block(ends.both);
  return force_field.block(is_first ? ends.first : ends.last);
}

void use_names_of(const ForceField& force_field, const ResidueBlock& block, Names& names) {
  for (std::string& name : names) {
    for (const AtomAlias& alias : force_field.block_aliases) {
      if (alias.from != name) continue;
      if (alias.residue != "*" && alias.residue != block.name && alias.residue != block.kind) continue;
      name = alias.to;
      break;
    }
  }
}

/// Returns the composition of a nucleotide. If the 5' end has a phosphate, it has the same block as a nucleotide within
/// the chain.
Composition nucleotide_with_ends(const ForceField& force_field, const ResidueBlock& block,
                                 const ResidueContext& context, Names& names) {
  const bool is_first = context.begins != ChainEnd::kBonded && !has(names, "P");
  const bool is_last = context.ends == ChainEnd::kEnd;
  const ResidueBlock* const end = end_block(force_field, block, is_first, is_last);
  const ResidueBlock& chosen = end != nullptr ? *end : block;
  use_names_of(force_field, chosen, names);
  return composition_of(force_field, chosen);
}

}  // namespace

std::size_t NamedAtoms::hydrogens_on(std::string_view heavy) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (carriers[i] != i && carriers[i] != kNowhere && names[carriers[i]] == heavy) ++count;
  }
  return count;
}

const ResidueBlock* block_named(const ForceField& force_field, std::string_view residue) {
  const auto renamed = force_field.block_of_residue.find(residue);
  const ResidueBlock* const block =
      force_field.block(renamed == force_field.block_of_residue.end() ? residue : renamed->second);
  return block == nullptr && residue == "NAC" ? force_field.block("NME") : block;
}

std::string_view canonical_residue(std::string_view name) {
  for (const auto& [other, canonical] : kResidueNames) {
    if (other == name) return canonical;
  }
  return name;
}

bool begins_cut(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context) {
  if (context.begins != ChainEnd::kEnd || has_own_charges(residue)) return false;
  if (!is_amino_acid(force_field, residue.name) || residue.name == "PRO" || residue.name == "PGLU") return false;
  return named_atoms(force_field, residue, context).hydrogens_on("N") == 1;
}

const ResidueBlock& choose_block(const ForceField& force_field, std::string_view residue_name,
                                 const ResidueContext& context, NamedAtoms& named) {
  const std::string_view canonical = canonical_residue(residue_name);
  const ResidueBlock* chosen = nullptr;
  if (canonical == "HIS") chosen = block_named(force_field, histidine_block(named, context));
  if (canonical == "ASP" || canonical == "ASPH")
    chosen = block_named(force_field, acid_block(named, 'D', canonical, "ASPH"));
  if (canonical == "GLU" || canonical == "GLUH")
    chosen = block_named(force_field, acid_block(named, 'E', canonical, "GLUH"));
  if (canonical == "CYS" && context.in_disulfide && named.hydrogens_on("SG") == 0)
    chosen = block_named(force_field, "CYS2");
  if (canonical == "LYS" && named.hydrogens_on("NZ") == 2) chosen = block_named(force_field, "LYSN");
  return chosen != nullptr ? *chosen : *default_block(force_field, residue_name);
}

NamedAtoms named_atoms(const ForceField& force_field, const PdbResidue& residue, const ResidueContext& context) {
  return {normalised_names(force_field, residue, *default_block(force_field, residue.name), context),
          carriers(residue)};
}

/// Returns the composition of a residue, including its chain ends. A residue that is a whole chain with two charged
/// ends gets the entries for a zwitterion.
Composition block_with_ends(const ForceField& force_field, const ResidueBlock& block, const ResidueContext& context,
                            NamedAtoms& named) {
  Names& names = named.names;
  if (block.is_nucleotide()) return nucleotide_with_ends(force_field, block, context, names);
  Composition made = composition_of(force_field, block);
  if (!block.is_amino_acid()) {
    use_names_of(force_field, block, names);
    return made;
  }
  std::string n_end = n_terminus(named, block.name, context.begins);
  std::string c_end;
  if (has(names, "OXT")) {
    const bool has_hydrogen_on_oxt = named.hydrogens_on("OXT") > 0;
    c_end = has_hydrogen_on_oxt || named.hydrogens_on("O") > 0 ? "COOH" : "COO-";
    // In GROMACS's COOH the oxygen with the hydrogen is called O; in PDB files it is called OXT.
    if (has_hydrogen_on_oxt) swap_names(names, "O", "OXT");
  }
  const ResidueBlock* const end = end_block(force_field, block, n_end.ends_with('+'), c_end == "COO-");
  use_names_of(force_field, end != nullptr ? *end : block, names);
  if (end != nullptr) return composition_of(force_field, *end);
  if (n_end.ends_with('+') && c_end == "COO-") {
    n_end = "ZWITTERION_" + n_end;
    c_end = "ZWITTERION_" + c_end;
  }
  const TerminusEdit* n_edit = n_end.empty() ? nullptr : find_edit(force_field.n_termini, block.name, n_end);
  const TerminusEdit* c_edit = c_end.empty() ? nullptr : find_edit(force_field.c_termini, block.name, c_end);
  if (n_edit != nullptr) apply(*n_edit, made);
  if (c_edit != nullptr) apply(*c_edit, made);
  return made;
}

bool is_amino_acid(const ForceField& force_field, std::string_view residue_name) {
  const ResidueBlock* block = default_block(force_field, residue_name);
  return block != nullptr && block->is_amino_acid();
}

bool is_chain_residue(const ForceField& force_field, std::string_view residue_name) {
  const ResidueBlock* block = default_block(force_field, residue_name);
  if (block == nullptr) return false;
  return block->is_amino_acid() || block->is_nucleotide() || std::ranges::find(kCaps, block->name) != kCaps.end();
}

bool is_histidine(std::string_view residue_name) {
  return canonical_residue(residue_name) == "HIS";
}

bool has_block(const ForceField& force_field, std::string_view residue_name) {
  return default_block(force_field, residue_name) != nullptr;
}

}  // namespace tandem::server

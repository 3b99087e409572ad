// Joins the structure reader and the force field into a molecule, and says what it left out.
#include "server/assets/structures/loader.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/units.hpp"
#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/pdb_reader.hpp"
#include "server/assets/structures/residue_typing.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxNamesInANote = 8;

std::string chain_name(const std::string& chain) {
  return chain.empty() ? "(blank)" : chain;
}

/// The first eight, and how many more there are. Names come from the file, so they are made printable.
template <class Entries, class Text>
std::string joined(const Entries& entries, const Text& text) {
  std::string list;
  std::size_t count = 0;
  for (const auto& entry : entries) {
    if (++count > kMaxNamesInANote) return list + " and " + std::to_string(entries.size() - kMaxNamesInANote) + " more";
    list += (list.empty() ? "" : ", ") + text(entry);
  }
  return list;
}

std::string joined(const std::set<std::string>& names) {
  return joined(names, [](const std::string& name) { return printable_text(name); });
}

/// Residues of one name that are no amino acids.
struct LeftOut {
  std::size_t residues = 0;
  std::size_t atoms = 0;
};
using LeftOutByName = std::map<std::string, LeftOut>;

/// "2 residues HOH (2 atoms)"
std::string text_of(const LeftOutByName::value_type& entry) {
  return counted(entry.second.residues, "residue ", "residues ") + printable_text(entry.first) + " (" +
         counted(entry.second.atoms, "atom", "atoms") + ")";
}

bool is_selected(const std::vector<std::string>& selected, const std::string& chain) {
  return selected.empty() || std::find(selected.begin(), selected.end(), chain) != selected.end();
}

void check_chains(const std::vector<PdbResidue>& protein, const std::vector<std::string>& selected,
                  const std::string& source) {
  std::set<std::string> chains;
  std::set<std::string> shown;
  for (const PdbResidue& residue : protein) {
    chains.insert(residue.chain);
    shown.insert(chain_name(residue.chain));
  }
  if (chains.empty()) {
    throw docking::MoleculeError(source + ": no protein atoms; a structure in PDB format with amino acids is needed");
  }
  for (const std::string& wanted : selected) {
    if (!chains.contains(wanted)) {
      throw docking::MoleculeError(source + ": no protein in chain '" + wanted + "'; chains with protein are " +
                                   joined(shown));
    }
  }
}

/// Splits the protein residues off; the others of the selected chains are counted by name for a note.
std::vector<PdbResidue> take_protein(std::vector<PdbResidue>&& residues, const ForceField& force_field,
                                     const std::vector<std::string>& selected, LeftOutByName& left_out) {
  std::vector<PdbResidue> protein;
  for (PdbResidue& residue : residues) {
    if (is_protein_residue(force_field, residue.name)) {
      protein.push_back(std::move(residue));
    } else if (is_selected(selected, residue.chain)) {
      LeftOut& same_name = left_out[residue.name];
      ++same_name.residues;
      same_name.atoms += residue.atoms.size();
    }
  }
  return protein;
}

bool has_atom(const PdbResidue& residue, std::string_view name) {
  return std::any_of(residue.atoms.begin(), residue.atoms.end(),
                     [name](const PdbAtom& atom) { return atom.name == name; });
}

bool follows_in_chain(const PdbResidue& earlier, const PdbResidue& later) {
  return earlier.chain == later.chain && earlier.segment == later.segment && !has_atom(earlier, "OXT");
}

class Loader {
 public:
  Loader(const ForceField& force_field, docking::Molecule& molecule) : force_field_(force_field), molecule_(molecule) {}

  void add(const PdbResidue& residue, const ResidueContext& context) {
    const TypedResidue typed = type_residue(force_field_, residue, context);
    for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
      add_atom(residue, residue.atoms[i], typed.atoms[i], typed.guesses[i]);
    }
    expected_hydrogens_ += typed.expected_hydrogens;
    missing_hydrogens_ += typed.missing_hydrogens;
    for (const std::string& name : typed.missing_heavy) {
      ++missing_heavy_;
      incomplete_.insert(residue.name + " " + residue.id + " " + name);
    }
  }

  void write_notes(const LeftOutByName& left_out, const PdbStructure& structure) {
    if (!left_out.empty()) {
      note("left out, no amino acids of " + force_field_.name + ": " +
           joined(left_out, [](const auto& entry) { return text_of(entry); }));
    }
    if (!molecule_.guessed.empty()) {
      note(counted(molecule_.guessed.size(), "atom", "atoms") + " without an exact entry in " + force_field_.name +
           " guessed (" +
           joined(guesses_,
                  [](const auto& entry) { return printable_text(entry.first) + " " + std::to_string(entry.second); }) +
           "), the first: " + molecule_.guessed.begin()->second);
    }
    if (missing_hydrogens_ > 0) {
      note(std::to_string(missing_hydrogens_) + " of " + std::to_string(expected_hydrogens_) +
           " hydrogens are not in the file: heavy atoms keep their all-atom parameters, so the attraction is too weak");
    }
    if (missing_heavy_ > 0) {
      note(std::to_string(missing_heavy_) + " other atoms are not in the file: " + joined(incomplete_));
    }
    if (structure.alternate_atoms > 0) {
      note(std::to_string(structure.alternate_atoms) + " atoms of other alternate locations in the file left out");
    }
    if (structure.duplicate_atoms > 0) {
      note(std::to_string(structure.duplicate_atoms) + " atoms that the file gives twice left out");
    }
    if (structure.has_more_models) note("all models of the file but the first left out");
  }

 private:
  void add_atom(const PdbResidue& residue, const PdbAtom& atom, const BlockAtom& entry, const std::string& guess) {
    const AtomType& type = force_field_.type(entry.type);
    if (!guess.empty()) {
      molecule_.guessed.emplace(molecule_.size(), guess);
      ++guesses_[residue.name];
    }
    molecule_.positions_angstrom.push_back(atom.position_angstrom);
    molecule_.sigma_angstrom.push_back(type.sigma_angstrom);
    molecule_.epsilon_kj_per_mol.push_back(type.epsilon_kj_per_mol);
    molecule_.charge_e.push_back(entry.charge_e);
    molecule_.mass_u.push_back(type.mass_u);
    molecule_.atom_names.push_back(atom.name);
    molecule_.residue_names.push_back(residue.name);
    molecule_.types.push_back(entry.type);
  }

  void note(std::string text) { molecule_.notes.push_back(std::move(text)); }

  const ForceField& force_field_;
  docking::Molecule& molecule_;
  std::size_t expected_hydrogens_ = 0;
  std::size_t missing_hydrogens_ = 0;
  std::size_t missing_heavy_ = 0;
  std::set<std::string> incomplete_;
  std::map<std::string, std::size_t> guesses_;  ///< atoms, by the name of their residue
};

std::vector<bool> disulfides_of(const std::vector<PdbResidue>& protein, const std::string& source) {
  try {
    return find_disulfides(protein);
  } catch (const docking::MoleculeError& error) {
    throw docking::MoleculeError(source + ": " + error.what());
  }
}

}  // namespace

docking::Molecule load_molecule(const std::filesystem::path& structure, const std::vector<std::string>& chains,
                                const std::filesystem::path& force_field_directory) {
  const ForceField force_field = load_force_field(force_field_directory);
  PdbStructure read = read_pdb(structure);
  LeftOutByName left_out;
  const std::vector<PdbResidue> protein = take_protein(std::move(read.residues), force_field, chains, left_out);
  check_chains(protein, chains, structure.string());
  // Over all chains: a disulfide may lead to a chain that is not selected.
  const std::vector<bool> in_disulfide = disulfides_of(protein, structure.string());
  docking::Molecule molecule;
  molecule.force_field = force_field.name;
  Loader loader(force_field, molecule);
  for (std::size_t r = 0; r < protein.size(); ++r) {
    if (!is_selected(chains, protein[r].chain)) continue;
    ResidueContext context;
    context.first_of_chain = r == 0 || !follows_in_chain(protein[r - 1], protein[r]);
    context.last_of_chain = r + 1 == protein.size() || !follows_in_chain(protein[r], protein[r + 1]);
    context.in_disulfide = in_disulfide[r];
    loader.add(protein[r], context);
  }
  loader.write_notes(left_out, read);
  try {
    docking::validate(molecule);
  } catch (const std::invalid_argument& error) {
    throw docking::MoleculeError(structure.string() + " with " + force_field.directory + ": " + error.what());
  }
  return molecule;
}

}  // namespace tandem::server

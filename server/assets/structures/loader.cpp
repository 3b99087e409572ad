// Joins the structure reader and the force field into a molecule, and says what it left out.
#include "server/assets/structures/loader.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/units.hpp"
#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/residue_typing.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxNamesInANote = 8;
constexpr double kSigmaPerRadius = 1.7817974362806785;  // 2^(5/6)
constexpr double kMinSigmaAngstrom = 0.1;               // what docking::validate() allows, or none
constexpr double kSamePlaceAngstrom = 0.01;

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

void check_selection(const std::vector<PdbResidue>& protein, const std::vector<PdbResidue>& others,
                     const StructureSelection& selection, const std::string& source) {
  std::set<std::string> chains;
  std::set<std::string> shown;
  for (const PdbResidue& residue : protein) {
    chains.insert(residue.chain);
    shown.insert(chain_name(residue.chain));
  }
  for (const std::string& wanted : selection.entries) {
    StructureSelection one{{wanted}};
    const auto is_it = [&one](const PdbResidue& residue) { return one.takes_residue(residue); };
    if (wanted.find('/') != std::string::npos) {
      if (std::any_of(others.begin(), others.end(), is_it) || std::any_of(protein.begin(), protein.end(), is_it)) {
        continue;
      }
      std::set<std::string> names;
      for (const PdbResidue& residue : others) names.insert(residue.chain + "/" + residue.name);
      throw docking::MoleculeError(source + ": no residue '" + wanted + "'; other than amino acids there are " +
                                   (names.empty() ? "none" : joined(names)));
    }
    if (chains.contains(wanted)) continue;
    throw docking::MoleculeError(source + ": no protein in chain '" + printable_text(wanted) +
                                 "'; chains with protein are " + joined(shown));
  }
}

bool has_own_charges(const PdbResidue& residue) {
  return !residue.atoms.empty() && residue.atoms.front().charge_e.has_value();
}

/// Those selected; the others of the selected chains are counted by name for a note.
std::vector<PdbResidue> take_selected(const std::vector<PdbResidue>& others, const StructureSelection& selection,
                                      LeftOutByName& left_out, std::vector<std::string>& dropped) {
  std::vector<PdbResidue> taken;
  for (const PdbResidue& residue : others) {
    if (selection.takes_residue(residue) || (has_own_charges(residue) && selection.takes_chain(residue.chain))) {
      taken.push_back(residue);
    } else if (selection.takes_chain(residue.chain)) {
      LeftOut& same_name = left_out[residue.name];
      ++same_name.residues;
      same_name.atoms += residue.atoms.size();
      dropped.push_back(printable_text("residue " + residue.name + " " + residue.id + " of chain " + residue.chain) +
                        ": no amino acid, and not selected");
    }
  }
  return taken;
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
  Loader(const ForceField& force_field, docking::Molecule& molecule, StructureReport& report)
      : force_field_(force_field), molecule_(molecule), report_(report) {}

  void add(const PdbResidue& residue, const TypedResidue& typed) {
    for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
      add_atom(residue, residue.atoms[i], typed.atoms[i], typed.guesses[i]);
    }
    expected_hydrogens_ += typed.expected_hydrogens;
    missing_hydrogens_ += typed.missing_hydrogens;
    for (const std::string& name : typed.missing_heavy) {
      ++missing_heavy_;
      incomplete_.insert(residue.name + " " + residue.id + " " + name);
      report_.missing.push_back("atom " + place_text(residue, name));
    }
    for (const std::string& name : typed.missing_hydrogen_names) {
      report_.missing.push_back("hydrogen " + place_text(residue, name));
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
    if (force_field_.is_by_element) note_parameters();
    if (structure.alternate_atoms > 0) {
      note(std::to_string(structure.alternate_atoms) + " atoms of other alternate locations in the file left out");
    }
    if (structure.duplicate_atoms > 0) {
      note(std::to_string(structure.duplicate_atoms) + " atoms that the file gives twice left out");
    }
    if (structure.has_more_models) note("all models of the file but the first left out");
  }

 private:
  void note_parameters() {
    std::error_code error;
    const bool is_installed = std::filesystem::is_directory(kOplsDirectory, error);
    const auto has_charge = [](double charge_e) { return charge_e != 0; };
    const bool is_charged = std::any_of(molecule_.charge_e.begin(), molecule_.charge_e.end(), has_charge);
    note(built_in_note(is_installed, is_charged));
    if (std::find(molecule_.elements.begin(), molecule_.elements.end(), "H") == molecule_.elements.end())
      note("no hydrogens in the file, and none are built without OPLS-AA: the attraction is too weak");
  }

  void add_atom(const PdbResidue& residue, const PdbAtom& atom, const BlockAtom& entry, const std::string& guess) {
    const AtomType& type = force_field_.type(entry.type);
    if (!guess.empty()) {
      molecule_.guessed.emplace(molecule_.size(), guess);
      ++guesses_[residue.name];
    }
    // A radius is half the distance of the minimum, 2^(1/6) σ.
    const double sigma = atom.radius_angstrom ? kSigmaPerRadius * *atom.radius_angstrom : type.sigma_angstrom;
    molecule_.positions_angstrom.push_back(atom.position_angstrom);
    molecule_.sigma_angstrom.push_back(sigma < kMinSigmaAngstrom ? 0 : sigma);
    molecule_.epsilon_kj_per_mol.push_back(type.epsilon_kj_per_mol);
    molecule_.charge_e.push_back(atom.charge_e.value_or(entry.charge_e));
    molecule_.mass_u.push_back(type.mass_u);
    molecule_.atom_names.push_back(atom.name);
    molecule_.elements.push_back(atom.element);
    molecule_.residue_names.push_back(residue.name);
    molecule_.residue_ids.push_back(residue.id);
    molecule_.chains.push_back(residue.chain);
    molecule_.segments.push_back(residue.segment);
    report_.places.push_back(place_text(residue, atom.name));
    molecule_.types.push_back(entry.type);
  }

  void note(std::string text) { molecule_.notes.push_back(std::move(text)); }

  const ForceField& force_field_;
  docking::Molecule& molecule_;
  StructureReport& report_;
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

std::vector<ResidueContext> contexts_of(const std::vector<PdbResidue>& protein, const std::vector<bool>& in_disulfide) {
  std::vector<ResidueContext> contexts(protein.size());
  for (std::size_t r = 0; r < protein.size(); ++r) {
    contexts[r].first_of_chain = r == 0 || !follows_in_chain(protein[r - 1], protein[r]);
    contexts[r].last_of_chain = r + 1 == protein.size() || !follows_in_chain(protein[r], protein[r + 1]);
    contexts[r].in_disulfide = in_disulfide[r];
  }
  return contexts;
}

/// Sorted along x, so that only near ones are compared.
void check_places(const std::vector<Vec3>& positions, const std::vector<std::string>& places,
                  const std::string& source) {
  std::vector<std::size_t> order(positions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&positions](std::size_t i, std::size_t j) {
    return std::lexicographical_compare(positions[i].begin(), positions[i].end(), positions[j].begin(),
                                        positions[j].end());
  });
  for (std::size_t n = 1; n < order.size(); ++n) {
    const std::size_t i = order[n - 1], j = order[n];
    if ((positions[i] - positions[j]).cwiseAbs().maxCoeff() > kSamePlaceAngstrom) continue;
    throw docking::MoleculeError(source + ": atoms " + places[i] + " and " + places[j] +
                                 " are on one place; correct or delete one of them");
  }
}

}  // namespace

std::string built_in_note(bool is_installed, bool is_charged) {
  return (is_installed ? "" : "gromacs-data is not installed: ") + std::string("built-in parameters by element, ") +
         (is_charged ? "the file's charges; " : "no charges; ") +
         (is_installed ? "name " + std::string(kOplsDirectory) : "install gromacs-data") + " for OPLS-AA";
}

std::string default_force_field(const std::filesystem::path& opls) {
  std::error_code error;
  return std::filesystem::is_directory(opls, error) ? opls.string() : kBuiltInForceField;
}

docking::Molecule load_molecule(const std::filesystem::path& structure, const StructureSelection& selection,
                                const std::filesystem::path& force_field_directory, Hydrogens hydrogens,
                                StructureReport* report) {
  const ForceField force_field = load_force_field(force_field_directory);
  if (force_field.is_by_element && hydrogens != Hydrogens::kGiven) {
    throw docking::MoleculeError(
        structure.string() + ": hydrogens are built and united by rules of OPLS-AA, which built-in parameters lack; " +
        "install the Debian package gromacs-data, or take the hydrogens that are given");
  }
  if (force_field.name != kOplsName && hydrogens == Hydrogens::kUnited) {
    throw docking::MoleculeError(structure.string() + ": " + force_field.name +
                                 " has no united atoms; take given or build, or OPLS-AA (" + kOplsDirectory + ")");
  }
  PdbStructure read = read_structure(structure);
  std::vector<PdbResidue> protein, others;
  for (PdbResidue& residue : read.residues) {
    (is_protein_residue(force_field, residue.name) ? protein : others).push_back(std::move(residue));
  }
  const std::string source = structure.string();
  check_selection(protein, others, selection, source);
  // Over all chains: a disulfide may lead to a chain that is not selected.
  const std::vector<bool> in_disulfide = disulfides_of(protein, source);
  docking::Molecule molecule;
  molecule.force_field = force_field.name;
  molecule.mixes_arithmetically = force_field.mixes_arithmetically;
  StructureReport told;
  told.dropped = std::move(read.dropped);
  Loader loader(force_field, molecule, told);
  const std::vector<ResidueContext> contexts = contexts_of(protein, in_disulfide);
  // Over all chains: a residue's hydrogens may depend on the one before.
  if (hydrogens != Hydrogens::kGiven) build_hydrogens(force_field, protein, contexts);
  for (std::size_t r = 0; r < protein.size(); ++r) {
    if (!selection.takes_chain(protein[r].chain) && !selection.takes_residue(protein[r])) continue;
    TypedResidue typed = force_field.is_by_element ? type_by_element(force_field, protein[r])
                                                   : type_residue(force_field, protein[r], contexts[r]);
    if (hydrogens == Hydrogens::kUnited) unite_hydrogens(force_field, protein[r], typed);
    loader.add(protein[r], typed);
  }
  LeftOutByName left_out;
  for (const PdbResidue& residue : take_selected(others, selection, left_out, told.dropped)) {
    loader.add(residue, type_by_element(force_field, residue));
  }
  if (molecule.size() == 0) {
    throw docking::MoleculeError(source +
                                 ": no protein atoms; a structure with amino acids is needed, or a choice of " +
                                 "residues, e.g. FILE:A/LIG");
  }
  loader.write_notes(left_out, read);
  check_places(molecule.positions_angstrom, told.places, source);
  try {
    docking::validate(molecule);
  } catch (const std::invalid_argument& error) {
    throw docking::MoleculeError(source + " with " + force_field.directory + ": " + error.what());
  }
  if (report != nullptr) *report = std::move(told);
  return molecule;
}

bool needs_hydrogens(const docking::Molecule& molecule, const std::filesystem::path& force_field_directory) {
  constexpr double kHydrogen_u = 1.5;
  const bool has_any = std::ranges::any_of(molecule.mass_u, [](double mass_u) { return mass_u < kHydrogen_u; });
  return !has_any && force_field_directory != kBuiltInForceField;
}

}  // namespace tandem::server

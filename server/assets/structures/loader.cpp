// Combines the structure readers and the force field into a molecule, and reports everything that was left out.
#include "server/assets/structures/loader.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/units.hpp"
#include "server/assets/structures/force_field.hpp"
#include "server/assets/structures/prepared_structure.hpp"
#include "server/assets/structures/residue_typing.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxNamesInANote = 8;
constexpr double kSigmaPerRadius = 1.7817974362806785;  // σ divided by the radius of a PQR file: 2^(5/6)
// Lower limit of docking::validate(). Atoms with a smaller σ have no Lennard-Jones term.
constexpr double kMinSigmaAngstrom = 0.1;
constexpr double kLostCharge_e = 0.1;
constexpr double kSamePlaceAngstrom = 0.01;

std::string chain_name(const std::string& chain) {
  return chain.empty() ? "(blank)" : chain;
}

/// Returns a list of the first eight entries and the number of further entries. The entries contain names from the
/// file, so they are made printable.
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

/// Number of residues and atoms that are not loaded, for residues of one name that are not amino acids.
struct LeftOut {
  std::size_t residues = 0;
  std::size_t atoms = 0;
};
using LeftOutByName = std::map<std::string, LeftOut>;

/// Formats an entry, e.g. "2 residues HOH (2 atoms)".
std::string text_of(const LeftOutByName::value_type& entry) {
  return counted(entry.second.residues, "residue ", "residues ") + printable_text(entry.first) + " (" +
         counted(entry.second.atoms, "atom", "atoms") + ")";
}

/// Returns the names of the residues of one chain.
std::set<std::string> names_in(const std::vector<PdbResidue>& residues, std::string_view chain) {
  std::set<std::string> names;
  for (const PdbResidue& residue : residues) {
    if (residue.chain == chain) names.insert(residue.name);
  }
  return names;
}

void check_selection(const std::vector<PdbResidue>& in_chains, const std::vector<PdbResidue>& others,
                     const StructureSelection& selection, const std::string& source) {
  std::set<std::string> chains;
  std::set<std::string> shown;
  for (const PdbResidue& residue : in_chains) {
    chains.insert(residue.chain);
    shown.insert(chain_name(residue.chain));
  }
  for (const std::string& wanted : selection.entries) {
    StructureSelection one{{wanted}};
    const auto is_it = [&one](const PdbResidue& residue) { return one.takes_residue(residue); };
    if (wanted.find('/') != std::string::npos) {
      if (std::ranges::any_of(others, is_it) || std::ranges::any_of(in_chains, is_it)) continue;
      std::set<std::string> names;
      for (const PdbResidue& residue : others) names.insert(residue.chain + "/" + residue.name);
      throw docking::MoleculeError(source + ": no residue '" + wanted + "'; other than amino acids there are " +
                                   (names.empty() ? "none" : joined(names)));
    }
    if (chains.contains(wanted)) continue;
    if (const std::set<std::string> names = names_in(others, wanted); !names.empty()) {
      throw docking::MoleculeError(source + ": chain '" + printable_text(wanted) +
                                   "' has no amino acids or nucleotides of the force field; it has " + joined(names) +
                                   ": choose all of it with " + printable_text(wanted) +
                                   "/*; chains with such residues are " + joined(shown));
    }
    throw docking::MoleculeError(source + ": no protein in chain '" + printable_text(wanted) +
                                 "'; chains with protein are " + joined(shown));
  }
}

/// Returns the selected residues among `others`. Residues of the selected chains that are not selected themselves are
/// counted by name in `left_out`, for a note.
std::vector<PdbResidue> pick_selected(const std::vector<PdbResidue>& others, const StructureSelection& selection,
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

class Loader {
 public:
  Loader(const ForceField& force_field, docking::Molecule& molecule, StructureReport& report)
      : force_field_(force_field), molecule_(molecule), report_(report) {}

  void add_of_chain(const PdbResidue& residue, const ResidueContext& context, Hydrogens hydrogens) {
    if (force_field_.is_by_element) return add(residue, type_by_element(force_field_, residue));
    PdbResidue united = residue;
    TypedResidue typed = type_residue(force_field_, residue, context);
    if (hydrogens == Hydrogens::kUnited) unite_hydrogens(force_field_, united, typed);
    if (hydrogens != Hydrogens::kGiven && !has_own_charges(residue)) complete_charge(united, typed);
    add(united, typed);
  }

  /// Adds a residue that belongs to no chain. Water and ions get the types and charges of their blocks (force-field
  /// entries) if all of their atoms are present. A water without hydrogens would otherwise have the negative charge of
  /// its oxygen. All other residues get parameters by element.
  void add_other(const PdbResidue& residue) {
    if (!force_field_.is_by_element && has_block(force_field_, residue.name)) {
      const TypedResidue typed = type_residue(force_field_, residue, {});
      if (typed.missing_hydrogens + typed.missing_heavy.size() == 0) return add(residue, typed);
    }
    add_unknown(residue, type_by_element(force_field_, residue));
  }

  void add(const PdbResidue& residue, const TypedResidue& typed) {
    for (std::size_t i = 0; i < residue.atoms.size(); ++i) {
      add_atom(residue, residue.atoms[i], typed.atoms[i], typed.guesses[i]);
    }
    if (typed.expected_charge_e && !has_own_charges(residue) && !residue.atoms.empty()) {
      implied_.push_back({molecule_.size() - residue.atoms.size(), *typed.expected_charge_e});
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

  /// Adds a residue without an entry in the force field. Its charge is unknown, and no hydrogens are added to those in
  /// the file.
  void add_unknown(const PdbResidue& residue, const TypedResidue& typed) {
    add(residue, typed);
    if (has_own_charges(residue)) return;
    const auto has_element = [&residue](std::string_view element) {
      return std::ranges::any_of(residue.atoms, [element](const PdbAtom& atom) { return atom.element == element; });
    };
    if (has_element("C") && !has_element("H")) ++without_hydrogens_[residue.name];
    const std::optional<int> formal = formal_charge_of(residue);
    if (formal && *formal == 0) return;
    if (formal) uncharged_.push_back(residue_place(residue) + " (" + signed_charge(*formal) + " e)");
    if (!formal && residue.atoms.size() > 1) uncharged_.push_back(residue_place(residue) + " (not known)");
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
    if (!without_hydrogens_.empty()) {
      note("without hydrogens in the file, and none are built: " + joined(without_hydrogens_, [](const auto& entry) {
             return counted(entry.second, "residue ", "residues ") + printable_text(entry.first);
           }));
    }
    if (!force_field_.is_by_element) write_charge_notes();
    if (force_field_.is_by_element) note_parameters();
    write_chain_notes();
    if (structure.alternate_atoms > 0) {
      note(std::to_string(structure.alternate_atoms) + " atoms of other alternate locations in the file left out");
    }
    if (structure.duplicate_atoms > 0) {
      note(std::to_string(structure.duplicate_atoms) + " atoms that the file gives twice left out");
    }
    if (structure.has_more_models) note("all models of the file but the first left out");
  }

  /// Corrects the charge of a residue with an incomplete side chain to the nearest whole number.
  void complete_charge(const PdbResidue& residue, TypedResidue& typed) {
    const std::optional<double> charge_e = make_whole(residue, typed);
    if (!charge_e || !typed.expected_charge_e) return;
    const double lost_e = *typed.expected_charge_e - *charge_e;
    if (std::abs(lost_e) > kLostCharge_e) {
      uncharged_.push_back(residue_place(residue) + " (" + signed_charge(lost_e) + " e, incomplete)");
    }
    typed.expected_charge_e = charge_e;
  }

  /// Adds notes about the origin of the hydrogens, if the user left the choice open or if hydrogens were rebuilt.
  void write_hydrogen_notes(Hydrogens wanted, const std::vector<std::string>& rebuilt) {
    const auto plain = [](const std::string& text) { return text; };
    if (wanted == Hydrogens::kAsNeeded && report_.hydrogens == "build") {
      note("hydrogens built, for the chosen chains have none in the file");
    }
    if (!rebuilt.empty()) {
      note("hydrogens that are on no atom, or one too many, were left out and missing ones built in " +
           counted(rebuilt.size(), "residue: ", "residues: ") +
           joined(rebuilt, [](const std::string& name) { return printable_text(name); }));
    }
    if (!report_.moved.empty()) {
      note(counted(report_.moved.size(), "group", "groups") +
           " of built hydrogens turned or bent, for they overlapped other atoms");
    }
    if (!report_.clashes.empty()) {
      note("built hydrogens that still overlap other atoms of the file: " + joined(report_.clashes, plain));
    }
  }

 private:
  void write_charge_notes() {
    report_.charge = net_charge(molecule_, implied_);
    const auto plain = [](const std::string& text) { return text; };
    // Without the hydrogens, the charges of residues are not whole numbers, so a warning about them would be useless.
    const bool has_hydrogens = 2 * missing_hydrogens_ <= expected_hydrogens_;
    note("net charge " + charge_text(report_.charge) + (has_hydrogens ? "" : "; hydrogens are missing"));
    if (has_hydrogens && !report_.charge.suspects.empty()) {
      note("charges that are not those of a whole residue: " + joined(report_.charge.suspects, plain));
    }
    if (has_hydrogens && !report_.charge.is_whole()) {
      note("the net charge is not whole in chain " + joined(report_.charge.fractional_chains, plain) +
           ": Coulomb energies are doubtful; complete the structure, or build its hydrogens");
    }
    if (!uncharged_.empty()) {
      note("charges that are lost, of groups that " + force_field_.name +
           " does not contain or the file has in part: " +
           joined(uncharged_, [](const std::string& text) { return printable_text(text); }));
    }
  }

  void write_chain_notes() {
    const auto printable = [](const std::string& text) { return printable_text(text); };
    if (!report_.gaps.empty()) {
      note(counted(report_.gaps.size(), "gap", "gaps") +
           " in chains, whose ends are neutral as within a chain: " + joined(report_.gaps, printable));
    }
    if (!report_.built.empty()) note("built at ends of chains: " + joined(report_.built, printable));
    if (!report_.histidines.empty()) {
      note("histidines without hydrogens in the file: " +
           joined(report_.histidines, [](const std::string& text) { return text; }));
    }
  }

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
    // A PQR file gives as radius half the distance of the energy minimum, which is 2^(1/6) σ.
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
  std::vector<ImpliedCharge> implied_;
  std::vector<std::string> uncharged_;
  std::map<std::string, std::size_t> without_hydrogens_;  ///< number of residues by name
  std::map<std::string, std::size_t> guesses_;            ///< number of atoms by residue name
};

/// Refuses two atoms at one position. The atoms are sorted along x, so that only neighbours in x are compared.
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

/// Moves built hydrogens of a structure that overlap other atoms. The structures in `beside` are loaded as well,
/// because the hydrogens must also avoid their atoms.
RelaxedHydrogens relax(PreparedStructure& prepared, const ForceField& force_field,
                       const std::filesystem::path& structure, std::span<const StructureSource> beside) {
  if (prepared.groups.empty()) return {};
  std::vector<PreparedStructure> neighbours;
  for (const StructureSource& source : beside) {
    // A structure from the same file is skipped, because `prepared` already contains all chains of that file.
    std::error_code error;
    if (std::filesystem::equivalent(source.file, structure, error) || error) continue;
    PreparedStructure& neighbour = neighbours.emplace_back(read_residues(source.file, force_field));
    complete_residues(neighbour, force_field, source.hydrogens, source.selection, source.file.string());
  }
  std::vector<RelaxedPart> parts{{&prepared.chains, &prepared.others, &prepared.groups}};
  for (PreparedStructure& neighbour : neighbours) {
    parts.push_back({&neighbour.chains, &neighbour.others, &neighbour.groups});
  }
  return relax_hydrogens(parts);
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
                                StructureReport* report, std::span<const StructureSource> beside) {
  const ForceField force_field = load_force_field(force_field_directory);
  const std::string source = structure.string();
  PreparedStructure prepared = read_residues(structure, force_field);
  check_selection(prepared.chains, prepared.others, selection, source);
  complete_residues(prepared, force_field, hydrogens, selection, source);
  const RelaxedHydrogens relaxed = relax(prepared, force_field, structure, beside);
  docking::Molecule molecule;
  molecule.force_field = force_field.name;
  molecule.mixes_arithmetically = force_field.mixes_arithmetically;
  StructureReport found;
  found.dropped = std::move(prepared.read.dropped);
  found.hydrogens = text_of(prepared.hydrogens);
  found.moved = relaxed.moved;
  found.clashes = relaxed.clashes;
  Loader loader(force_field, molecule, found);
  const std::vector<PdbResidue>& chains = prepared.chains;
  for (std::size_t r = 0; r < chains.size(); ++r) {
    if (!selection.takes_chain(chains[r].chain) && !selection.takes_residue(chains[r])) continue;
    loader.add_of_chain(chains[r], prepared.contexts[r], prepared.hydrogens);
    const HistidineChoice& histidine = prepared.histidines[r];
    if (!histidine.block.empty()) {
      found.histidines.push_back(residue_place(chains[r]) + ": " + histidine.block + ", " + histidine.reason);
    }
    if (std::ranges::binary_search(prepared.ended, r)) found.built.push_back("atom " + place_text(chains[r], "OXT"));
    if (prepared.contexts[r].begins == ChainEnd::kGap) found.gaps.push_back("before " + residue_place(chains[r]));
    if (prepared.hydrogens == Hydrogens::kGiven && begins_cut(force_field, chains[r], prepared.contexts[r])) {
      found.gaps.push_back("before " + residue_place(chains[r]) + ", which has one hydrogen on N");
    }
  }
  LeftOutByName left_out;
  for (const PdbResidue& residue : pick_selected(prepared.others, selection, left_out, found.dropped)) {
    loader.add_other(residue);
  }
  if (molecule.size() == 0) {
    throw docking::MoleculeError(source +
                                 ": no protein atoms; a structure with amino acids is needed, or a choice of " +
                                 "residues, e.g. FILE:A/LIG");
  }
  loader.write_hydrogen_notes(hydrogens, prepared.rebuilt);
  loader.write_notes(left_out, prepared.read);
  check_places(molecule.positions_angstrom, found.places, source);
  try {
    docking::validate(molecule);
  } catch (const std::invalid_argument& error) {
    throw docking::MoleculeError(source + " with " + force_field.directory + ": " + error.what());
  }
  if (report != nullptr) *report = std::move(found);
  return molecule;
}

}  // namespace tandem::server

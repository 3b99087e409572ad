// See prepared_structure.hpp.
#include "server/assets/structures/prepared_structure.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "server/assets/structures/chain_links.hpp"
#include "server/assets/structures/residue_typing.hpp"

namespace tandem::server {
namespace {

std::vector<bool> disulfides_of(const std::vector<PdbResidue>& chains, const std::string& source) {
  try {
    return find_disulfides(chains);
  } catch (const docking::MoleculeError& error) {
    throw docking::MoleculeError(source + ": " + error.what());
  }
}

std::vector<ResidueContext> contexts_of(const std::vector<PdbResidue>& chains, const std::vector<bool>& in_disulfide,
                                        const std::vector<HistidineChoice>& histidines) {
  const std::vector<ChainLink> links = chain_links(chains);
  std::vector<ResidueContext> contexts(chains.size());
  for (std::size_t r = 0; r < chains.size(); ++r) {
    contexts[r] = {links[r].previous, links[r].begins, links[r].ends, in_disulfide[r], histidines[r].block};
  }
  return contexts;
}

void append(std::vector<BuiltGroup>& groups, std::vector<BuiltGroup> more) {
  for (BuiltGroup& group : more) groups.push_back(std::move(group));
}

/// Replaces hydrogens that do not fit the block (force-field entry) of their residue by those that the block expects.
void rebuild_misfits(const ForceField& force_field, PreparedStructure& structure) {
  for (std::size_t r = 0; r < structure.chains.size(); ++r) {
    PdbResidue& residue = structure.chains[r];
    if (has_own_charges(residue)) continue;
    const TypedResidue typed = type_residue(force_field, residue, structure.contexts[r]);
    if (typed.misfits.empty()) continue;
    for (auto i = typed.misfits.rbegin(); i != typed.misfits.rend(); ++i) {
      structure.read.dropped.push_back("hydrogen " + place_text(residue, residue.atoms[*i].name) +
                                       ": on no atom, or one too many on it; built where one is missing");
      residue.atoms.erase(residue.atoms.begin() + static_cast<std::ptrdiff_t>(*i));
    }
    append(structure.groups, complete_hydrogens(force_field, structure.chains, structure.contexts, r));
    structure.rebuilt.push_back(residue_place(residue));
  }
}

/// Refuses a structure that has only the alpha carbon or the phosphorus of each residue. Its molecular field would be
/// meaningless.
void refuse_traces(const std::vector<PdbResidue>& chains, const std::string& source) {
  constexpr std::size_t kFewResidues = 4;
  const auto is_one_atom = [](const PdbResidue& residue) {
    return residue.atoms.size() == 1 && !has_own_charges(residue) &&
           (residue.atoms.front().name == "CA" || residue.atoms.front().name == "P");
  };
  const auto traces = static_cast<std::size_t>(std::ranges::count_if(chains, is_one_atom));
  if (traces < kFewResidues || 2 * traces < chains.size()) return;
  throw docking::MoleculeError(
      source + ": " + std::to_string(traces) + " of " + std::to_string(chains.size()) +
      " residues have only an alpha carbon or a phosphorus; forces need all atoms: take a file " +
      "with side chains, or rebuild them with a modelling program");
}

void check_hydrogens(const ForceField& force_field, Hydrogens hydrogens, const std::string& source) {
  if (force_field.is_by_element && (hydrogens == Hydrogens::kBuild || hydrogens == Hydrogens::kUnited)) {
    throw docking::MoleculeError(
        source + ": hydrogens are built and united by rules of OPLS-AA, which built-in parameters lack; " +
        "install the Debian package gromacs-data, or take the hydrogens that are given");
  }
  if (force_field.name != kOplsName && hydrogens == Hydrogens::kUnited) {
    throw docking::MoleculeError(source + ": " + force_field.name +
                                 " has no united atoms; take given or build, or OPLS-AA (" + kOplsDirectory + ")");
  }
}

/// Renames the atoms and residues of nucleotides in files from before 2007 to their current names: O5* becomes O5', and
/// A without the hydroxyl of C2' becomes DA.
void modernise_nucleotide(PdbResidue& residue) {
  if (find_atom(residue, "C1*") != nullptr) {
    for (PdbAtom& atom : residue.atoms) std::ranges::replace(atom.name, '*', '\'');
  }
  if (residue.name.size() != 1 || std::string_view("ACGTUI").find(residue.name) == std::string_view::npos) return;
  const bool is_deoxyribose = find_atom(residue, "C2'") != nullptr && find_atom(residue, "O2'") == nullptr;
  if (is_deoxyribose) residue.name = "D" + residue.name;
}

/// Replaces Hydrogens::kAsNeeded by a definite choice. It is kBuild if the chosen chains have no hydrogens and the
/// force field has rules for them; otherwise kGiven.
Hydrogens needed_hydrogens(const PreparedStructure& structure, const ForceField& force_field,
                           const StructureSelection& selection) {
  if (force_field.is_by_element) return Hydrogens::kGiven;
  bool has_residues = false;
  for (const PdbResidue& residue : structure.chains) {
    if (!selection.takes_chain(residue.chain) && !selection.takes_residue(residue)) continue;
    has_residues = true;
    const auto is_hydrogen = [](const PdbAtom& atom) { return atom.element == "H"; };
    if (std::ranges::any_of(residue.atoms, is_hydrogen)) return Hydrogens::kGiven;
  }
  return has_residues ? Hydrogens::kBuild : Hydrogens::kGiven;
}

}  // namespace

PreparedStructure read_residues(const std::filesystem::path& structure, const ForceField& force_field) {
  PreparedStructure prepared;
  prepared.read = read_structure(structure);
  for (PdbResidue& residue : prepared.read.residues) {
    modernise_nucleotide(residue);
    (is_chain_residue(force_field, residue.name) ? prepared.chains : prepared.others).push_back(std::move(residue));
  }
  prepared.read.residues.clear();
  return prepared;
}

void complete_residues(PreparedStructure& structure, const ForceField& force_field, Hydrogens hydrogens,
                       const StructureSelection& selection, const std::string& source) {
  check_hydrogens(force_field, hydrogens, source);
  refuse_traces(structure.chains, source);
  structure.histidines = choose_histidines(structure.chains, structure.others);
  structure.contexts = contexts_of(structure.chains, disulfides_of(structure.chains, source), structure.histidines);
  structure.hydrogens =
      hydrogens == Hydrogens::kAsNeeded ? needed_hydrogens(structure, force_field, selection) : hydrogens;
  if (force_field.is_by_element) return;
  if (structure.hydrogens == Hydrogens::kGiven) return rebuild_misfits(force_field, structure);
  for (std::size_t r = 0; r < structure.chains.size(); ++r) {
    const bool is_end = structure.contexts[r].ends == ChainEnd::kEnd;
    if (is_end && complete_chain_end(force_field, structure.chains[r])) structure.ended.push_back(r);
  }
  append(structure.groups, build_hydrogens(force_field, structure.chains, structure.contexts));
}

}  // namespace tandem::server

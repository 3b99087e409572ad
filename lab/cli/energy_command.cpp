// `tandem-lab energy`: interaction energy, force and torque of two structures in the poses that their files contain,
// computed in double precision.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "common/base/units.hpp"
#include "common/docking/atom_contacts.hpp"
#include "common/docking/exact_field.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/commands.hpp"
#include "lab/cli/docking_pair.hpp"
#include "server/assets/structures/structure_writer.hpp"
#include "server/assets/structures/text.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;
namespace fs = std::filesystem;

/// A residue is listed if the magnitude of its Lennard-Jones energy or of its Coulomb energy is at least this value.
constexpr double kMinResidueEnergyKjPerMol = 0.01;

/// Minimum number of atom pairs for which progress is shown. The evaluation of so many pairs takes about 2 s in double
/// precision.
constexpr std::size_t kPairsWithProgress = 50'000'000;
/// Maximum number of pairs for which the energy without cut-off is also computed. That computation takes about 0.1 s in
/// single precision.
constexpr std::size_t kPairsToCompare = 200'000'000;

struct EnergyOptions {
  DockingOptions pair;
  std::vector<double> move_angstrom;
  std::string save;
  bool prints_residues = false;
  bool prints_atoms = false;
  bool prints_report = false;
  bool prints_json = false;
  bool accepts_charge = false;
};

struct ResidueEnergy {
  std::size_t atom = 0;                                  ///< index of the first atom of the residue
  Eigen::Vector2d kj_per_mol = Eigen::Vector2d::Zero();  ///< Lennard-Jones and Coulomb energy
};

struct Energies {
  docking::FieldResult result;
  Pose X_AB;
  std::vector<Vec3> on_receptor, on_ligand;
  std::vector<ResidueEnergy> of_receptor, of_ligand;  ///< filled only if requested; largest magnitude first
  Vec3 centre = Vec3::Zero();  ///< centre of mass of the ligand, in the coordinates of the receptor's file
  Vec3 torque = Vec3::Zero();  ///< torque about that centre
  /// pairs of atoms that are closer to each other than atoms without a bond can be
  std::vector<docking::CloseAtoms> close;
  /// energy without cut-off; computed only if there is a cut-off and at most kPairsToCompare pairs
  std::optional<double> all_pairs_kj_per_mol;
};

std::vector<ResidueEnergy> residues_of(const docking::Molecule& molecule,
                                       const std::vector<Eigen::Vector2d>& atom_energies) {
  const std::vector<std::size_t> starts = docking::residue_starts(molecule);
  const std::vector<Eigen::Vector2d> sums = docking::residue_energies(molecule, atom_energies);
  std::vector<ResidueEnergy> residues;
  for (std::size_t r = 0; r < starts.size(); ++r) residues.push_back({starts[r], sums[r]});
  std::erase_if(residues, [](const ResidueEnergy& residue) {
    return residue.kj_per_mol.cwiseAbs().maxCoeff() < kMinResidueEnergyKjPerMol;
  });
  std::stable_sort(residues.begin(), residues.end(), [](const ResidueEnergy& one, const ResidueEnergy& two) {
    return std::abs(one.kj_per_mol.sum()) > std::abs(two.kj_per_mol.sum());
  });
  return residues;
}

Energies energies_of(const DockingPair& pair, const EnergyOptions& options) {
  Energies found;
  if (!options.move_angstrom.empty()) found.X_AB.p = Vec3(options.move_angstrom.data());
  std::vector<Eigen::Vector2d> of_receptor, of_ligand;
  docking::ExactDetails details{&found.on_receptor, &found.on_ligand};
  if (pair.receptor.size() * pair.ligand.size() > kPairsWithProgress) {
    details.progress = [show = progress_on_stderr()](double done) { show("summing all pairs of atoms", done); };
  }
  if (options.prints_residues) {
    details.energies_of_a = &of_receptor;
    details.energies_of_b = &of_ligand;
  }
  found.result = docking::exact_field(pair.receptor, pair.ligand, found.X_AB, pair.model, details);
  if (options.prints_residues) {
    found.of_receptor = residues_of(pair.receptor, of_receptor);
    found.of_ligand = residues_of(pair.ligand, of_ligand);
  }
  if (pair.model.cutoff_angstrom > 0 && pair.receptor.size() * pair.ligand.size() <= kPairsToCompare) {
    docking::FieldModel all = pair.model;
    all.cutoff_angstrom = 0;
    found.all_pairs_kj_per_mol =
        docking::MolecularField(pair.receptor, pair.ligand, all).evaluate(found.X_AB).energy_kj_per_mol();
  }
  found.close = docking::close_atoms(pair.receptor, pair.ligand, found.X_AB);
  const Vec3 arm = pair.ligand.centre_of_mass_angstrom();
  found.centre = found.X_AB * arm;
  found.torque = found.result.torque_on_b - arm.cross(found.result.force_on_b);
  return found;
}

json::array strings(const std::vector<std::string>& texts) {
  json::array all;
  for (const std::string& text : texts) all.emplace_back(text);
  return all;
}

json::array atoms_json(const docking::Molecule& molecule, const server::StructureReport& report, const Pose& X,
                       const std::vector<Vec3>& forces) {
  json::array rows;
  for (std::size_t i = 0; i < molecule.size(); ++i) {
    rows.emplace_back(json::object{{"atom", report.places[i]},
                                   {"type", molecule.types[i]},
                                   {"position_angstrom", json_of(X * molecule.positions_angstrom[i])},
                                   {"sigma_angstrom", molecule.sigma_angstrom[i]},
                                   {"epsilon_kj_mol", molecule.epsilon_kj_per_mol[i]},
                                   {"charge_e", molecule.charge_e[i]},
                                   {"force_kj_mol_angstrom", json_of(forces[i])}});
  }
  return rows;
}

json::array residues_json(const docking::Molecule& molecule, const std::vector<ResidueEnergy>& residues) {
  json::array rows;
  for (const auto& [atom, energy] : residues) {
    rows.emplace_back(json::object{{"chain", server::printable_text(molecule.chains[atom])},
                                   {"residue", server::printable_text(molecule.residue_names[atom])},
                                   {"number", server::printable_text(molecule.residue_ids[atom])},
                                   {"lj_kj_mol", energy[0]},
                                   {"coulomb_kj_mol", energy[1]},
                                   {"total_kj_mol", energy.sum()}});
  }
  return rows;
}

json::object charge_json(const server::NetCharge& charge) {
  json::object chains;
  for (const server::ChainCharge& chain : charge.chains) chains[server::printable_text(chain.chain)] = chain.charge_e;
  return {{"net_e", charge.total_e},
          {"chains_e", std::move(chains)},
          {"is_whole", charge.is_whole()},
          {"not_whole", strings(charge.suspects)}};
}

const char* text_of(docking::Closeness closeness) {
  switch (closeness) {
    case docking::Closeness::kHydrogenBond:
      return "hydrogen bond";
    case docking::Closeness::kBond:
      return "bond";
    default:
      return "clash";
  }
}

json::array close_json(const DockingPair& pair, const Energies& found) {
  json::array rows;
  for (const docking::CloseAtoms& close : found.close) {
    rows.emplace_back(json::object{{"receptor", pair.receptor_report.places[close.a]},
                                   {"ligand", pair.ligand_report.places[close.b]},
                                   {"distance_angstrom", close.distance_angstrom},
                                   {"share_of_radii", close.share},
                                   {"kind", text_of(close.closeness)}});
  }
  return rows;
}

/// Returns a text that names the molecules whose total charge is not an integer. The text is empty if there are none,
/// or if the user accepted such charges.
std::string doubtful_charges(const DockingPair& pair, const EnergyOptions& options) {
  if (options.accepts_charge) return {};
  std::string which;
  if (!pair.receptor_report.charge.is_whole()) which = "receptor";
  if (!pair.ligand_report.charge.is_whole()) which += which.empty() ? "ligand" : " and ligand";
  return which;
}

json::object report_json(const docking::Molecule& molecule, const server::StructureReport& report) {
  json::array guessed;
  for (const auto& [atom, why] : molecule.guessed) guessed.emplace_back(why);
  return {{"guessed", std::move(guessed)},      {"missing", strings(report.missing)},
          {"dropped", strings(report.dropped)}, {"built", strings(report.built)},
          {"gaps", strings(report.gaps)},       {"histidines", strings(report.histidines)},
          {"hydrogens", report.hydrogens},      {"moved", strings(report.moved)},
          {"clashes", strings(report.clashes)}};
}

json::object energy_json(const DockingPair& pair, const Energies& found, const EnergyOptions& options) {
  const docking::FieldResult& result = found.result;
  json::object object{{"atoms_receptor", pair.receptor.size()},
                      {"atoms_ligand", pair.ligand.size()},
                      {"unassigned", pair.receptor.guessed.size() + pair.ligand.guessed.size()},
                      {"force_field", pair.receptor.force_field},
                      {"mixing", pair.receptor.mixes_arithmetically ? "arithmetic" : "geometric"},
                      {"dielectric", options.pair.dielectric},
                      {"cutoff_angstrom", pair.model.cutoff_angstrom},
                      {"lj_kj_mol", result.lennard_jones_kj_per_mol},
                      {"coulomb_kj_mol", result.coulomb_kj_per_mol},
                      {"charges_accepted", doubtful_charges(pair, options).empty()},
                      {"receptor_charge", charge_json(pair.receptor_report.charge)},
                      {"ligand_charge", charge_json(pair.ligand_report.charge)},
                      {"total_kj_mol", result.energy_kj_per_mol()},
                      {"force_on_ligand_kj_mol_angstrom", json_of(result.force_on_b)},
                      {"torque_on_ligand_kj_mol", json_of(found.torque)},
                      {"torque_about_angstrom", json_of(found.centre)},
                      {"close_pairs", close_json(pair, found)},
                      {"receptor_notes", strings(pair.receptor.notes)},
                      {"ligand_notes", strings(pair.ligand.notes)}};
  if (found.all_pairs_kj_per_mol) object["all_pairs_kj_mol"] = *found.all_pairs_kj_per_mol;
  if (options.prints_report) {
    object["receptor_report"] = report_json(pair.receptor, pair.receptor_report);
    object["ligand_report"] = report_json(pair.ligand, pair.ligand_report);
  }
  if (options.prints_residues) {
    object["receptor_residues"] = residues_json(pair.receptor, found.of_receptor);
    object["ligand_residues"] = residues_json(pair.ligand, found.of_ligand);
  }
  if (!options.save.empty()) object["saved"] = options.save;
  if (options.prints_atoms) {
    object["receptor_atoms"] = atoms_json(pair.receptor, pair.receptor_report, Pose{}, found.on_receptor);
    object["ligand_atoms"] = atoms_json(pair.ligand, pair.ligand_report, found.X_AB, found.on_ligand);
  }
  return object;
}

void print_lines(const char* what, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::printf("%s%s\n", what, line.c_str());
}

void print_molecule(const char* which, const docking::Molecule& molecule, const server::StructureReport& report,
                    bool prints_report) {
  std::printf("%s: %zu atoms, %zu without an exact entry in %s\n", which, molecule.size(), molecule.guessed.size(),
              molecule.force_field.c_str());
  print_lines("  note: ", molecule.notes);
  if (!prints_report) return;
  for (const auto& [atom, why] : molecule.guessed) std::printf("  guessed: %s\n", why.c_str());
  print_lines("  missing: ", report.missing);
  print_lines("  left out: ", report.dropped);
  print_lines("  not whole: ", report.charge.suspects);
  print_lines("  built: ", report.built);
  print_lines("  gap: ", report.gaps);
  print_lines("  histidine: ", report.histidines);
  print_lines("  moved: ", report.moved);
  print_lines("  overlaps: ", report.clashes);
}

/// Prints the energies of the listed residues. The last line contains the sum over all residues that are not listed, so
/// that the columns add up to the total energies.
void print_residues(const char* which, const docking::Molecule& molecule, const std::vector<ResidueEnergy>& residues,
                    const docking::FieldResult& result) {
  std::printf("%s, chain residue number: Lennard-Jones, Coulomb, both [kJ/mol]\n", which);
  Eigen::Vector2d others(result.lennard_jones_kj_per_mol, result.coulomb_kj_per_mol);
  for (const auto& [atom, energy] : residues) {
    std::printf("  %-4s %-5s %-6s %12.3f %12.3f %12.3f\n", server::printable_text(molecule.chains[atom]).c_str(),
                server::printable_text(molecule.residue_names[atom]).c_str(),
                server::printable_text(molecule.residue_ids[atom]).c_str(), energy[0], energy[1], energy.sum());
    others -= energy;
  }
  const std::size_t left = docking::residue_starts(molecule).size() - residues.size();
  if (left == 0) return;
  std::printf("  %-17s %12.3f %12.3f %12.3f\n", counted(left, "other", "others").c_str(), others[0], others[1],
              others.sum());
}

/// Prints the closest pairs of one kind, at most kMaxPairLines of them.
void print_close(const DockingPair& pair, const Energies& found, docking::Closeness closeness, const char* what) {
  constexpr std::size_t kMaxPairLines = 8;
  std::size_t count = 0;
  for (const docking::CloseAtoms& close : found.close) {
    if (close.closeness != closeness) continue;
    if (count == 0) std::printf("%s\n", what);
    if (++count > kMaxPairLines) continue;
    std::printf("  %s and %s: %.2f Å, %.2f of their radii\n", pair.receptor_report.places[close.a].c_str(),
                pair.ligand_report.places[close.b].c_str(), close.distance_angstrom, close.share);
  }
  if (count > kMaxPairLines) std::printf("  and %zu more, in --json\n", count - kMaxPairLines);
}

void print(const DockingPair& pair, const Energies& found, const EnergyOptions& options) {
  print_molecule("receptor", pair.receptor, pair.receptor_report, options.prints_report);
  print_molecule("ligand", pair.ligand, pair.ligand_report, options.prints_report);
  const docking::FieldResult& result = found.result;
  const Vec3& f = result.force_on_b;
  if (found.all_pairs_kj_per_mol) {
    std::printf("within %.4g Å; all pairs have %.8g kJ/mol, Lennard-Jones and Coulomb\n", pair.model.cutoff_angstrom,
                *found.all_pairs_kj_per_mol);
  }
  std::printf("Lennard-Jones %16.8g kJ/mol\nCoulomb       %16.8g kJ/mol\n", result.lennard_jones_kj_per_mol,
              result.coulomb_kj_per_mol);
  if (const std::string which = doubtful_charges(pair, options); !which.empty()) {
    std::printf("  doubtful: the net charge of the %s is not whole; --accept-charge if that is meant\n", which.c_str());
  }
  print_close(pair, found, docking::Closeness::kBond,
              "bonded to each other, so that their energy is none of a contact; make them one molecule:");
  print_close(pair, found, docking::Closeness::kClash, "clashes, nearer than 0.7 of the sum of van der Waals radii:");
  std::printf("force on the ligand  %.8g %.8g %.8g kJ/mol/Å\n", f.x(), f.y(), f.z());
  std::printf("torque on it         %.8g %.8g %.8g kJ/mol, about its centre of mass\n", found.torque.x(),
              found.torque.y(), found.torque.z());
  if (options.prints_residues) {
    print_residues("receptor", pair.receptor, found.of_receptor, result);
    print_residues("ligand", pair.ligand, found.of_ligand, result);
  }
  if (!options.save.empty()) std::printf("saved as %s\n", options.save.c_str());
}

/// Returns a remark for the saved file that names an input file without its folder, so that a published complex does
/// not reveal the user's folders.
std::string file_remark(const char* which, const std::string& text) {
  const server::StructureChoice choice = server::structure_choice(text);
  std::string remark = std::string(which) + " from " + fs::path(choice.file).filename().string();
  for (const std::string& entry : choice.selection.entries) remark += " " + entry;
  return remark;
}

/// Checks before the computation that the output name is valid and that the output would not overwrite an input
/// structure.
void check_save(const EnergyOptions& options) {
  if (options.save.empty()) return;
  server::check_complex_name(options.save);
  for (const std::string& text : {options.pair.receptor, options.pair.ligand}) {
    std::error_code error;
    if (!fs::equivalent(server::structure_choice(text).file, options.save, error) || error) continue;
    throw std::invalid_argument("--save " + options.save + " is one of the structures to read; give another name");
  }
}

void save(const DockingPair& pair, const Energies& found, const EnergyOptions& options) {
  std::vector<std::string> remarks = server::energy_remarks(found.result, pair.model);
  remarks.insert(remarks.begin(),
                 {file_remark("receptor", options.pair.receptor), file_remark("ligand", options.pair.ligand)});
  server::save_complex(options.save, pair.receptor, pair.ligand, found.X_AB, remarks);
}

void run_energy(const EnergyOptions& options) {
  check_save(options);
  DockingPair pair = load_docking_pair(options.pair);
  if (pair.model.has_far_grid) pair.model.cutoff_angstrom = 0;  // the exact evaluation does not use the far-field grid
  pair.model.has_far_grid = false;
  const Energies found = energies_of(pair, options);
  if (!options.save.empty()) save(pair, found, options);
  if (options.prints_json) {
    std::cout << pretty_json(energy_json(pair, found, options));
  } else {
    print(pair, found, options);
  }
}

}  // namespace

void add_energy_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<EnergyOptions>();
  CLI::App* const command = app.add_subcommand("energy", "Energy, force and torque between two molecular structures");
  add_docking_options(*command, options->pair);
  command->get_option("--cutoff")
      ->description(
          "none, a distance, 4 to 100 [Å], or auto: as in a room of tandem-server, 8 above a million pairs where "
          "it has no far grid; with one, all pairs");
  command->add_option("--move", options->move_angstrom, "the ligand by x,y,z before [Å]")->delimiter(',')->expected(3);
  auto* const atoms =
      command->add_flag("--atoms", options->prints_atoms, "with --json: each atom's parameters and the force on it");
  command->add_flag("--per-residue", options->prints_residues,
                    "each residue's energies with the other molecule [kJ/mol], where one is at least 0.01 kJ/mol");
  command->add_option("--save", options->save,
                      "write both as FILE.pdb or FILE.cif, receptor as in its file, ligand as moved [Å]");
  command->add_flag("--report", options->prints_report, "name each atom that is guessed, missing or left out");
  command->add_flag("--accept-charge", options->accepts_charge,
                    "accept net charges that are not whole, without a mark at the Coulomb energy");
  atoms->needs(command->add_flag("--json", options->prints_json, "print JSON"));
  command->callback([options, &exit_code] {
    run_energy(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab

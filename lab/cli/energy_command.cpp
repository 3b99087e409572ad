// `tandem-lab energy`: what two structures as they lie in their files do to each other, in double precision.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/docking/exact_field.hpp"
#include "lab/cli/commands.hpp"
#include "lab/cli/docking_pair.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

struct Options {
  DockingOptions pair;
  std::vector<double> move_angstrom;
  bool wants_atoms = false;
  bool wants_report = false;
  bool wants_json = false;
};

struct Energies {
  docking::FieldResult result;
  Pose X_AB;
  std::vector<Vec3> on_receptor, on_ligand;
  Vec3 centre = Vec3::Zero();  ///< of the ligand's mass, in the receptor's file
  Vec3 torque = Vec3::Zero();  ///< about it
};

Energies energies_of(const DockingPair& pair, const Options& options) {
  Energies found;
  if (!options.move_angstrom.empty()) found.X_AB.p = Vec3(options.move_angstrom.data());
  found.result =
      docking::exact_field(pair.receptor, pair.ligand, found.X_AB, pair.model, {&found.on_receptor, &found.on_ligand});
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

json::object report_json(const docking::Molecule& molecule, const server::StructureReport& report) {
  json::array guessed;
  for (const auto& [atom, why] : molecule.guessed) guessed.emplace_back(why);
  return {{"guessed", std::move(guessed)}, {"missing", strings(report.missing)}, {"dropped", strings(report.dropped)}};
}

json::object energy_json(const DockingPair& pair, const Energies& found, const Options& options) {
  const docking::FieldResult& result = found.result;
  json::object object{{"atoms_receptor", pair.receptor.size()},
                      {"atoms_ligand", pair.ligand.size()},
                      {"unassigned", pair.receptor.guessed.size() + pair.ligand.guessed.size()},
                      {"force_field", pair.receptor.force_field},
                      {"dielectric", options.pair.dielectric},
                      {"cutoff_angstrom", pair.model.cutoff_angstrom},
                      {"lj_kj_mol", result.lennard_jones_kj_per_mol},
                      {"coulomb_kj_mol", result.coulomb_kj_per_mol},
                      {"total_kj_mol", result.energy_kj_per_mol()},
                      {"force_on_ligand_kj_mol_angstrom", json_of(result.force_on_b)},
                      {"torque_on_ligand_kj_mol", json_of(found.torque)},
                      {"torque_about_angstrom", json_of(found.centre)},
                      {"receptor_notes", strings(pair.receptor.notes)},
                      {"ligand_notes", strings(pair.ligand.notes)}};
  if (options.wants_report) {
    object["receptor_report"] = report_json(pair.receptor, pair.receptor_report);
    object["ligand_report"] = report_json(pair.ligand, pair.ligand_report);
  }
  if (options.wants_atoms) {
    object["receptor_atoms"] = atoms_json(pair.receptor, pair.receptor_report, Pose{}, found.on_receptor);
    object["ligand_atoms"] = atoms_json(pair.ligand, pair.ligand_report, found.X_AB, found.on_ligand);
  }
  return object;
}

void print_lines(const char* what, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::printf("%s%s\n", what, line.c_str());
}

void print_molecule(const char* which, const docking::Molecule& molecule, const server::StructureReport& report,
                    bool wants_report) {
  std::printf("%s: %zu atoms, %zu without an exact entry in %s\n", which, molecule.size(), molecule.guessed.size(),
              molecule.force_field.c_str());
  print_lines("  note: ", molecule.notes);
  if (!wants_report) return;
  for (const auto& [atom, why] : molecule.guessed) std::printf("  guessed: %s\n", why.c_str());
  print_lines("  missing: ", report.missing);
  print_lines("  left out: ", report.dropped);
}

void print(const DockingPair& pair, const Energies& found, const Options& options) {
  print_molecule("receptor", pair.receptor, pair.receptor_report, options.wants_report);
  print_molecule("ligand", pair.ligand, pair.ligand_report, options.wants_report);
  const docking::FieldResult& result = found.result;
  const Vec3& f = result.force_on_b;
  std::printf("Lennard-Jones %16.8g kJ/mol\nCoulomb       %16.8g kJ/mol\n", result.lennard_jones_kj_per_mol,
              result.coulomb_kj_per_mol);
  std::printf("force on the ligand  %.8g %.8g %.8g kJ/mol/Å\n", f.x(), f.y(), f.z());
  std::printf("torque on it         %.8g %.8g %.8g kJ/mol, about its centre of mass\n", found.torque.x(),
              found.torque.y(), found.torque.z());
}

void run(const Options& options) {
  const DockingPair pair = load_docking_pair(options.pair);
  const Energies found = energies_of(pair, options);
  if (options.wants_json) {
    std::cout << pretty_json(energy_json(pair, found, options));
  } else {
    print(pair, found, options);
  }
}

}  // namespace

void add_energy_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command = app.add_subcommand("energy", "Energy, force and torque between two molecular structures");
  add_docking_options(*command, options->pair);
  command->add_option("--move", options->move_angstrom, "the ligand by x,y,z before [Å]")->delimiter(',')->expected(3);
  command->add_flag("--atoms", options->wants_atoms, "with --json: each atom's parameters and the force on it");
  command->add_flag("--report", options->wants_report, "name each atom that is guessed, missing or left out");
  command->add_flag("--json", options->wants_json, "print JSON");
  command->callback([options, &exit_code] {
    run(*options);
    exit_code = 0;
  });
}

}  // namespace tandem::lab

// Command-line options of the commands `energy` and `bench docking`. They select two structure files and the model of
// the molecular field between them.
#pragma once

#include <optional>
#include <string>

#include "common/base/json.hpp"
#include "common/docking/field_model.hpp"
#include "server/assets/structures/loader.hpp"

namespace CLI {
class App;
}

namespace tandem::lab {

struct DockingOptions {
  std::string receptor;
  std::string ligand;
  std::string hydrogens;  ///< empty: the hydrogens of a file are kept; if it has none, they are built
  std::string cutoff = "none";
  std::string dielectric = "4r";
  std::string force_field_directory = server::default_force_field();
};

struct DockingPair {
  docking::Molecule receptor;
  docking::Molecule ligand;
  server::StructureReport receptor_report;
  server::StructureReport ligand_report;
  docking::FieldModel model;
};

/// Adds the options --receptor F --ligand F [--hydrogens H] [--cutoff C] [--dielectric D] [--force-field DIR].
void add_docking_options(CLI::App& command, DockingOptions& options);

/// Parses --cutoff [Å]. "none" gives 0 and "auto" gives nullopt. Throws std::invalid_argument for any other text that
/// is not a number.
std::optional<double> cutoff_of(const std::string& text);

/// Loads both structures and selects the field model.
/// Fails   docking::MoleculeError or std::invalid_argument that names the file or the option
DockingPair load_docking_pair(const DockingOptions& options);

boost::json::array json_of(const Vec3& vector);

}  // namespace tandem::lab

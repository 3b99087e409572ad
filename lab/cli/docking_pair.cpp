#include "lab/cli/docking_pair.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <stdexcept>

#include "server/assets/field_choice.hpp"

namespace tandem::lab {
namespace {

bool parse_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// Selects the field model in the same way as a room of the server (server::choose_field()). That function expects
/// molecules whose centre is at the origin. Therefore it is applied to copies that are moved to the origin.
void choose_as_a_room(DockingPair& pair) {
  docking::Molecule receptor = pair.receptor, ligand = pair.ligand;
  const Vec3 centre = receptor.centre(), offset = ligand.centre() - centre;
  server::choose_field(receptor, ligand, offset, pair.model);
}

server::StructureSource source_of(const DockingOptions& options, const std::string& text) {
  const server::StructureChoice choice = server::structure_choice(text);
  return {choice.file, choice.selection, server::hydrogens_of(options.hydrogens)};
}

docking::Molecule load(const DockingOptions& options, const server::StructureSource& source,
                       const server::StructureSource& beside, server::StructureReport& report) {
  return server::load_molecule(source.file, source.selection, options.force_field_directory, source.hydrogens, &report,
                               {&beside, 1});
}

}  // namespace

void add_docking_options(CLI::App& command, DockingOptions& options) {
  command
      .add_option("--receptor", options.receptor, "structure file, or FILE:A,B/LIG for chain A and residues LIG of B")
      ->required();
  command.add_option("--ligand", options.ligand, "likewise")->required();
  command
      .add_option("--hydrogens", options.hydrogens,
                  "those given, built anew, or united with carbon [default: given, or built where a file has none]")
      ->check(CLI::IsMember({"given", "build", "united"}));
  command
      .add_option(
          "--cutoff", options.cutoff,
          "none, a distance, 4 to 100 [Å], or auto: as in a room of tandem-server, none up to a million pairs, "
          "above that 8 and, where both are small enough, a grid of the part beyond, else the smallest that keeps the "
          "well")
      ->capture_default_str();
  command.add_option("--dielectric", options.dielectric, "none (no charges), a constant such as 1, or 4r")
      ->capture_default_str();
  command
      .add_option("--force-field", options.force_field_directory,
                  "folder of GROMACS parameters, a name of its own such as amber99sb, or built-in")
      ->capture_default_str();
}

std::optional<double> cutoff_of(const std::string& text) {
  if (text == "auto") return std::nullopt;
  double cutoff_angstrom = 0;
  if (text != "none" && !parse_number(text, cutoff_angstrom)) {
    throw std::invalid_argument("--cutoff " + text + ": must be none, auto or a distance of 4 to 100 Å");
  }
  return cutoff_angstrom;
}

DockingPair load_docking_pair(const DockingOptions& options) {
  DockingPair pair;
  const server::StructureSource receptor = source_of(options, options.receptor),
                                ligand = source_of(options, options.ligand);
  pair.receptor = load(options, receptor, ligand, pair.receptor_report);
  pair.ligand = load(options, ligand, receptor, pair.ligand_report);
  docking::set_dielectric(pair.model, options.dielectric);
  if (const auto cutoff = cutoff_of(options.cutoff)) {
    pair.model.cutoff_angstrom = *cutoff;
  } else {
    choose_as_a_room(pair);
  }
  docking::validate(pair.model);
  return pair;
}

boost::json::array json_of(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace tandem::lab

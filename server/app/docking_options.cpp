#include "server/app/docking_options.hpp"

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "common/base/folders.hpp"
#include "proto/content_hash.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/structures/structure_file.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kNameBytes = 6;

struct DockingOptions {
  std::string receptor, ligand;  ///< "FILE:CHAINS/RESIDUES", e.g. "1stp.pdb:A,B/478"; both empty: no docking room
  std::string hydrogens;         ///< empty: chosen by docking_scene()
  std::string dielectric;        ///< empty: chosen by docking_scene()
  std::string force_field;       ///< empty: chosen by docking_scene()
  std::optional<double> cutoff_angstrom;
  bool has_far_grid = false;
};

/// Parses a choice of atoms of the form "FILE:CHAINS/RESIDUES", the value of `option` (--receptor or --ligand).
wire::MoleculeSource source_of(const std::string& option, const std::string& text, const std::string& hydrogens) {
  if (structure_choice(text).file.empty()) throw std::invalid_argument(option + " \"" + text + "\" names no file");
  return molecule_source(text, hydrogens);
}

void declare(CLI::App& app, DockingOptions& options) {
  app.add_option("--receptor", options.receptor,
                 "room of two molecules, one in each hand: a structure file (PDB, mmCIF, PQR), or FILE:A,B/LIG for its "
                 "chain A and the residues LIG of B")
      ->type_name("FILE[:CHAINS]");
  app.add_option("--ligand", options.ligand, "likewise, the other")->type_name("FILE[:CHAINS]");
  app.add_option("--hydrogens", options.hydrogens,
                 "of both: those given, built anew, or united with carbon [given, or built where a file has none]")
      ->check(CLI::IsMember({"given", "build", "united"}).description(""))
      ->type_name("given|build|united");
  app.add_option(
         "--dielectric", options.dielectric,
         "of their charges: none (no charges), a constant such as 1, or one times the distance [Å] such as 4r [4r]")
      ->type_name("TEXT");
  app.add_option("--force-field", options.force_field,
                 "of both: a folder of GROMACS parameters, a name of its own such as amber99sb, or built-in [oplsaa]")
      ->type_name("DIR|NAME");
  app.add_option(
         "--cutoff", options.cutoff_angstrom,
         "of both: no force beyond, 4 to 100 [Å]; 0: none [0 up to a million pairs of atoms; above, 8, and --far-grid "
         "where both are small enough, else the smallest that keeps the well of all pairs within 5 %, if a step can "
         "have it; one that is given has no grid by itself]")
      ->type_name("FLOAT");
  app.add_flag(
      "--far-grid", options.has_far_grid,
      "with --cutoff: the part beyond it, up to 40 Å or farther, from a grid about the larger molecule (about half a "
      "second's work when the room is made)");
}

std::filesystem::path write(const DockingOptions& options, const std::filesystem::path& folder) {
  if (options.receptor.empty() && options.ligand.empty()) {
    if (options.hydrogens.empty() && options.dielectric.empty() && options.force_field.empty() &&
        !options.cutoff_angstrom && !options.has_far_grid) {
      return {};
    }
    throw std::invalid_argument(
        "--hydrogens, --dielectric, --force-field, --cutoff and --far-grid are of --receptor and --ligand; a scene "
        "file names its own");
  }
  if (options.receptor.empty() || options.ligand.empty()) {
    throw std::invalid_argument("--receptor and --ligand go together: give both");
  }
  if (options.has_far_grid && options.cutoff_angstrom == 0.0) {
    throw std::invalid_argument("--far-grid holds the part beyond a cut-off: leave out --cutoff 0, or give --cutoff 8");
  }
  if (folder.empty()) throw std::invalid_argument("--receptor keeps its scene in the folder --cache: give one");
  wire::MolecularField field;
  field.set_dielectric(options.dielectric);
  field.set_force_field_directory(options.force_field);
  if (options.cutoff_angstrom) field.set_cutoff_angstrom(*options.cutoff_angstrom);
  field.set_far_grid(options.has_far_grid);
  const std::string text = scene_text(docking_scene(source_of("--receptor", options.receptor, options.hydrogens),
                                                    source_of("--ligand", options.ligand, options.hydrogens), field));
  const auto bytes = std::as_bytes(std::span(text));
  const std::string name = proto::hex(proto::sha256_of(bytes)).substr(0, 2 * kNameBytes);
  std::filesystem::path file = std::filesystem::absolute(folder) / ("docking-" + name + ".json");
  if (const std::error_code error = replace_file(file, {bytes})) {
    throw std::invalid_argument(file.string() + " cannot be written: " + error.message() + "; choose another --cache");
  }
  return file;
}

}  // namespace

WriteDockingScene declare_docking(CLI::App& app) {
  const auto options = std::make_shared<DockingOptions>();
  declare(app, *options);
  return [options](const std::filesystem::path& folder) { return write(*options, folder); };
}

}  // namespace tandem::server

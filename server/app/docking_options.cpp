#include "server/app/docking_options.hpp"

#include <stdexcept>
#include <string>

#include "common/base/folders.hpp"
#include "proto/content_hash.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/assets/structures/structure_file.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kNameBytes = 6;

/// Of "FILE:A,B/478".
wire::MoleculeSource source_of(const std::string& text) {
  const StructureChoice choice = structure_choice(text);
  wire::MoleculeSource source;
  source.set_file(std::filesystem::absolute(choice.file).string());
  for (const std::string& entry : choice.selection.entries) source.add_chains(entry);
  return source;
}

void add_molecule(CLI::App& app, const std::string& name, wire::Scene& scene, const std::string& help) {
  const auto take = [&scene, name](const std::string& text) {
    wire::Body& body = *scene.add_bodies();
    body.set_name(name);
    *body.add_shapes()->mutable_molecule() = source_of(text);
  };
  app.add_option_function<std::string>("--" + name, take, help)->type_name("FILE[:CHAINS]");
}

const wire::MoleculeSource* find(const wire::Scene& scene, const std::string& name) {
  for (const wire::Body& body : scene.bodies()) {
    if (body.name() == name) return &body.shapes(0).molecule();
  }
  return nullptr;
}

}  // namespace

std::shared_ptr<const wire::Scene> declare_docking(CLI::App& app) {
  const auto scene = std::make_shared<wire::Scene>();
  wire::MolecularField& field = *scene->mutable_molecular_field();
  add_molecule(
      app, "receptor", *scene,
      "room of two molecules, one in each hand: a structure file (PDB, mmCIF, PQR), or FILE:A,B/LIG for its chain A "
      "and the residues LIG of B");
  add_molecule(app, "ligand", *scene, "likewise, the other");
  // After the two: what is parsed is taken in the order in which it is declared.
  const auto set_hydrogens = [scene](const std::string& text) {
    for (wire::Body& body : *scene->mutable_bodies()) body.mutable_shapes(0)->mutable_molecule()->set_hydrogens(text);
  };
  app.add_option_function<std::string>(
         "--hydrogens", set_hydrogens,
         "of both: those given, built anew, or united with carbon [given, or built where a file has none]")
      ->check(CLI::IsMember({"given", "build", "united"}).description(""))
      ->type_name("given|build|united");
  app.add_option_function<std::string>(
         "--dielectric", [&field, scene](const std::string& text) { field.set_dielectric(text); },
         "of the charges: none (no charges), a constant such as 1, or one times the distance [Å] such as 4r [4r]")
      ->type_name("TEXT");
  app.add_option_function<double>(
         "--cutoff", [&field, scene](double angstrom) { field.set_cutoff_angstrom(angstrom); },
         "no force beyond, 4 to 100 [Å]; 0: none [0, or 8 above a million pairs of atoms]")
      ->type_name("FLOAT");
  return scene;
}

std::filesystem::path write_docking_scene(const wire::Scene& asked, const std::filesystem::path& folder) {
  const wire::MoleculeSource* const receptor = find(asked, "receptor");
  const wire::MoleculeSource* const ligand = find(asked, "ligand");
  if (receptor == nullptr && ligand == nullptr) return {};
  if (receptor == nullptr || ligand == nullptr) {
    throw std::invalid_argument("--receptor and --ligand go together: give both");
  }
  if (folder.empty()) throw std::invalid_argument("--receptor writes its scene to the folder --cache: give one");
  const std::string text = scene_text(docking_scene(*receptor, *ligand, asked.molecular_field()));
  const auto bytes = std::as_bytes(std::span(text));
  const std::string name = proto::hex(proto::sha256_of(bytes)).substr(0, 2 * kNameBytes);
  std::filesystem::path file = folder / ("docking-" + name + ".json");
  if (const std::error_code error = replace_file(file, {bytes})) {
    throw std::invalid_argument(file.string() + " cannot be written: " + error.message() + "; choose another --cache");
  }
  return file;
}

}  // namespace tandem::server

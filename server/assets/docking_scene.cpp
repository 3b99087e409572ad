#include "server/assets/docking_scene.hpp"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <string>

#include "common/docking/molecular_field.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/physics/world_description.hpp"
#include "server/assets/field_choice.hpp"
#include "server/assets/molecular_scale.hpp"
#include "server/assets/scene_checks.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::server {
namespace {

/// Length scale for small molecules, and the limit for larger ones. The scale of a larger molecule is chosen such that
/// its radius of gyration becomes kGyrationRadius_m, that of an object in the hand.
constexpr double kMetresPerAngstrom = 0.01, kGyrationRadius_m = 0.08;
constexpr double kApart_angstrom = 8;
constexpr double kZeroArea_kt = 1;
/// Largest number of atom pairs for a field without cut-off that a scene file may request. With so many pairs a step
/// takes about 20 s on one core.
constexpr std::size_t kMaxPairs = 2'000'000'000;
constexpr double kMass_kg = 0.2;
/// Display colours (red, green, blue) of the two tools that hold the molecules.
constexpr std::array kColors{std::array{0.0, 0.62, 0.45}, std::array{0.8, 0.47, 0.65}};

StructureSource structure_source(const wire::MoleculeSource& message) {
  return {message.file(), {{message.chains().begin(), message.chains().end()}}, hydrogens_of(message.hydrogens())};
}

/// Loads a molecule, and writes the applied choice of hydrogens to `message`.
docking::Molecule load(wire::MoleculeSource& message, const std::string& force_field_directory,
                       const StructureSource& beside) {
  const StructureSource source = structure_source(message);
  StructureReport report;
  docking::Molecule molecule =
      load_molecule(source.file, source.selection, force_field_directory, source.hydrogens, &report, {&beside, 1});
  message.set_hydrogens(report.hydrogens);
  return molecule;
}

/// Rounds to a multiple of `step`, so that the file is readable. Callers use steps of 1 µm and 0.0001 degrees.
double rounded(double value, double step) {
  return std::round(value / step) * step;
}

/// Returns the length scale of the scene [m/Å]. The size of the larger molecule is limited: a hand resists only a small
/// torque, and a contact far from the centre of a large object would twist the object out of the hand.
/// In      a, b  positions relative to their own centres
double metres_per_angstrom(const docking::Molecule& a, const docking::Molecule& b) {
  const double radius_angstrom = std::max(a.gyration_radius_angstrom(), b.gyration_radius_angstrom());
  const double scale = kGyrationRadius_m / radius_angstrom;
  // The scale is rounded to three significant digits, not to a fixed number of decimals, because that of a very large
  // molecule would become 0.
  return std::min(kMetresPerAngstrom, rounded(scale, std::pow(10, std::floor(std::log10(scale)) - 2)));
}

template <class Numbers>
void append_rounded(Numbers* out, const Vec3& values, double step) {
  for (const double value : values) out->Add(rounded(value, step));
}

/// Places a molecule at `y_m` on the y axis. `q` rotates the scene such that the line of centres becomes the y axis.
void place(wire::Placement& placement, double y_m, const Quat& q) {
  append_rounded(placement.mutable_position_m(), {0, y_m, 0}, 1e-6);
  const Vec3 zyx = q.toRotationMatrix().eulerAngles(2, 1, 0);
  append_rounded(placement.mutable_rotation_xyz_deg(), zyx.reverse() * 180 / std::numbers::pi, 1e-4);
}

void add(wire::Scene& scene, const std::string& name, const wire::MoleculeSource& source, double y_m, const Quat& q) {
  wire::Body& body = *scene.add_bodies();
  body.set_name(name);
  *body.add_shapes()->mutable_molecule() = source;
  body.set_mass_kg(kMass_kg);
  body.set_gravity(false);
  body.set_graspable(true);
  body.set_linear_damping_per_s(2);
  body.set_angular_damping_per_s(2);
  for (const double part : kColors.at(static_cast<std::size_t>(scene.bodies_size() - 1))) body.add_color_rgb(part);
  place(*body.mutable_placement(), y_m, q);
  wire::Tool& tool = *scene.add_tools();
  tool.set_name(name);
  tool.set_holds(name);
  tool.set_mass_kg(body.mass_kg());
  append_rounded(tool.mutable_placement()->mutable_position_m(), {0, y_m, 0}, 1e-6);
}

/// Sets the default coupling law. The translational stiffness is 500 N/m at kMetresPerAngstrom, and inversely
/// proportional to the length scale. The force on a ligand in a narrow passage depends on the lag in ångström. At a
/// smaller scale, 1 Å corresponds to a shorter distance of the hand, so the same force needs a higher stiffness.
void set_coupling(wire::Coupling& coupling, double metres_per_angstrom) {
  constexpr double kMaxTurn = 1.75;
  const double stiffer = kMetresPerAngstrom / metres_per_angstrom, turn = std::min(stiffer, kMaxTurn);
  coupling.set_law(std::string(haptics::kDefaultCouplingLaw));
  coupling.set_stiffness_n_per_m(rounded(500 * stiffer, 10));
  coupling.set_damping_n_s_per_m(3);
  coupling.set_stiffness_n_m_per_rad(rounded(0.8 * turn, 0.1));
  coupling.set_damping_n_m_s_per_rad(rounded(0.008 * std::sqrt(turn), 0.001));
  coupling.set_force_limit_n(6.5);
  coupling.set_torque_limit_n_m(0.3);
}

}  // namespace

wire::Scene docking_scene(wire::MoleculeSource receptor, wire::MoleculeSource ligand,
                          const wire::MolecularField& field) {
  wire::Scene scene;
  wire::MolecularField& molecular = *scene.mutable_molecular_field();
  molecular = field;
  if (molecular.force_field_directory().empty()) molecular.set_force_field_directory(default_force_field());
  if (molecular.dielectric().empty()) molecular.set_dielectric(kDefaultDielectric);
  const StructureSource sources[] = {structure_source(receptor), structure_source(ligand)};
  docking::Molecule a = load(receptor, molecular.force_field_directory(), sources[1]);
  docking::Molecule b = load(ligand, molecular.force_field_directory(), sources[0]);
  const std::size_t pairs = a.size() * b.size();
  const Vec3 centre_a = a.centre();
  const Vec3 offset = b.centre() - centre_a;
  docking::FieldModel model;
  docking::set_dielectric(model, molecular.dielectric());
  if (molecular.has_cutoff_angstrom()) {
    model.cutoff_angstrom = molecular.cutoff_angstrom();
    model.has_far_grid = molecular.far_grid();
  } else if (molecular.far_grid()) {
    model.cutoff_angstrom = docking::kUsualCutoffAngstrom;
    model.has_far_grid = true;
  } else {
    choose_field(a, b, offset, model);
  }
  docking::validate(model);
  if (model.cutoff_angstrom == 0 && pairs > kMaxPairs) {
    throw std::invalid_argument("molecular field: " + std::to_string(a.size()) + " x " + std::to_string(b.size()) +
                                " atoms are too many for all pairs; give a cut-off, 8 Å is usual");
  }
  molecular.set_cutoff_angstrom(model.cutoff_angstrom);
  molecular.set_far_grid(model.has_far_grid);
  // The search for the contact distance uses only the short-range Lennard-Jones energy, so it needs no far-field grid.
  model.has_far_grid = false;
  if (model.cutoff_angstrom == 0 && pairs > docking::kMaxAllPairs) {
    model.cutoff_angstrom = docking::kUsualCutoffAngstrom;
  }
  if (!molecular.has_zero_area_kt() && pairs <= docking::kMaxAllPairs) molecular.set_zero_area_kt(kZeroArea_kt);

  molecular.set_metres_per_angstrom(metres_per_angstrom(a, b));
  const Vec3 line = line_of_centres(offset);
  const double half_m =
      0.5 * molecular.metres_per_angstrom() * (contact_distance_angstrom(a, b, model, line) + kApart_angstrom);
  const Quat q = Quat::FromTwoVectors(line, Vec3::UnitY());
  scene.set_name("docking");
  add(scene, "receptor", receptor, -half_m, q);
  add(scene, "ligand", ligand, half_m, q);
  set_coupling(*scene.mutable_coupling(), molecular.metres_per_angstrom());
  for (int i = 0; i < 3; ++i) scene.add_gravity_m_per_s2(0);
  wire::Limits& limits = *scene.mutable_limits();
  if (molecular.cutoff_angstrom() == 0 && pairs > physics::WorldLimits().atom_pairs) {
    limits.set_atom_pairs(static_cast<std::uint32_t>(pairs));
  }
  return scene;
}

wire::MoleculeSource molecule_source(const std::string& text, const std::string& hydrogens) {
  const StructureChoice choice = structure_choice(text);
  wire::MoleculeSource source;
  source.set_file(std::filesystem::absolute(choice.file).string());
  for (const std::string& entry : choice.selection.entries) source.add_chains(entry);
  source.set_hydrogens(hydrogens);
  return source;
}

std::string scene_text(const wire::Scene& scene) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.preserve_proto_field_names = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(scene, &text, options).ok()) text.clear();
  return text;
}

}  // namespace tandem::server

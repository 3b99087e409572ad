#include "server/assets/scene_checks.hpp"

#include <algorithm>
#include <set>

#include "common/docking/molecule.hpp"
#include "proto/state.hpp"
#include "server/assets/scene_coupling.hpp"
#include "server/assets/scene_effects.hpp"
#include "server/assets/scene_soft_checks.hpp"

namespace tandem::server {
namespace {

// Bounds of plausibility for desk- to room-sized scenes in SI units: a value outside is a slip of units or of
// the keyboard, and would only show as a strange simulation.
constexpr double kMaxPosition_m = 100;
constexpr double kMaxSize_m = 100;
constexpr double kMaxMass_kg = 1e4;
constexpr double kMaxDamping_per_s = 1e3;
constexpr double kMaxGravity_m_per_s2 = 1e3;
constexpr std::size_t kMaxNameBytes = 64;
constexpr std::size_t kMaxDescriptionBytes = 2000;
constexpr int kMaxShapes = 256;
constexpr double kMaxContactPoints = 1 << 20U;  // of a room; about 1 KiB each

/// 5 N on the ball of 5 mm of a tool then presses it 0.25 mm into a plane of the same stiffness. Ours.
constexpr double kDefaultContactStiffness_n_per_m3 = 1e10;

void check_name(const std::string& name, const SceneField& field) {
  if (name.empty()) field.refuse("is empty; give it a name");
  if (name.size() > kMaxNameBytes) {
    field.refuse("has " + std::to_string(name.size()) + " bytes; it must have at most " +
                 std::to_string(kMaxNameBytes));
  }
}

void check(wire::Box& box, const SceneField& field) {
  const SceneField size = field.in("size_m");
  if (box.size_m_size() != 3) {
    size.refuse("has " + std::to_string(box.size_m_size()) + " numbers; it must have 3 (full edge lengths x, y, z)");
  }
  for (int i = 0; i < 3; ++i)
    field.in("size_m", static_cast<std::size_t>(i)).require_positive(box.size_m(i), kMaxSize_m);
}

void complete_stiffness(double value, const SceneField& field) {
  // From soft rubber over a few millimetres to what double precision still resolves at a kilohertz.
  field.in("contact_stiffness_n_per_m3").require_within(value, 1e5, 1e13, "from 1e5 to 1e13");
}

void complete(wire::Shape& shape, const SceneField& field) {
  complete(*shape.mutable_placement(), field.in("placement"));
  switch (shape.kind_case()) {
    case wire::Shape::kSphere:
      return field.in("sphere").in("radius_m").require_positive(shape.sphere().radius_m(), kMaxSize_m);
    case wire::Shape::kBox:
      return check(*shape.mutable_box(), field.in("box"));
    case wire::Shape::kCylinder:
      field.in("cylinder").in("radius_m").require_positive(shape.cylinder().radius_m(), kMaxSize_m);
      return field.in("cylinder").in("length_m").require_positive(shape.cylinder().length_m(), kMaxSize_m);
    case wire::Shape::kCapsule:
      field.in("capsule").in("radius_m").require_positive(shape.capsule().radius_m(), kMaxSize_m);
      return field.in("capsule").in("length_m").require_positive(shape.capsule().length_m(), kMaxSize_m);
    case wire::Shape::kMesh:
      return check(*shape.mutable_mesh(), field.in("mesh"));
    case wire::Shape::kMolecule:
      if (shape.molecule().file().empty()) field.in("molecule").in("file").refuse("is empty; name a PDB file");
      if (!shape.molecule().asset_sha256().empty()) {
        field.in("molecule").in("asset_sha256").refuse("is the server's to set; leave it out");
      }
      return;
    case wire::Shape::KIND_NOT_SET:
      break;
  }
  field.refuse("has no kind; it must have one of sphere, box, cylinder, capsule, mesh, molecule");
}

void check_shape_count(int count, const SceneField& field) {
  if (count == 0) field.refuse("is empty; at least one shape is needed");
  if (count > kMaxShapes) {
    field.refuse("has " + std::to_string(count) + " shapes; at most " + std::to_string(kMaxShapes) + " are possible");
  }
}

/// A molecule is a body of its own: its centre of mass is the body's origin and its atoms give the inertia.
void check_molecule_stands_alone(const wire::Body& body, const SceneField& field) {
  for (int i = 0; i < body.shapes_size(); ++i) {
    if (!body.shapes(i).has_molecule()) continue;
    const SceneField shape = field.in("shapes", static_cast<std::size_t>(i));
    if (body.shapes_size() > 1) shape.in("molecule").refuse("has company; a molecule must be its body's only shape");
    const wire::Placement& placement = body.shapes(i).placement();
    const auto is_zero = [](double value) { return value == 0; };
    if (!std::all_of(placement.position_m().begin(), placement.position_m().end(), is_zero) ||
        !std::all_of(placement.rotation_xyz_deg().begin(), placement.rotation_xyz_deg().end(), is_zero)) {
      shape.in("placement").refuse("is not zero; a molecule's centre of mass is its body's origin: place the body");
    }
  }
}

void complete_surface(wire::Body& body, const SceneField& field) {
  if (!body.has_friction()) body.set_friction(0.5);
  if (!body.has_restitution()) body.set_restitution(0);
  field.in("friction").require_at_least_zero(body.friction(), 10);
  field.in("restitution").require_at_least_zero(body.restitution(), 1);
  if (!body.has_contact_stiffness_n_per_m3()) body.set_contact_stiffness_n_per_m3(kDefaultContactStiffness_n_per_m3);
  complete_stiffness(body.contact_stiffness_n_per_m3(), field);
  // The colour only informs viewers: a middle grey, as nothing else is known.
  if (body.color_rgb().empty()) {
    for (int i = 0; i < 3; ++i) body.add_color_rgb(0.7);
  }
  if (body.color_rgb_size() != 3) {
    field.in("color_rgb").refuse("has " + std::to_string(body.color_rgb_size()) + " numbers; it must have 3");
  }
  for (int i = 0; i < 3; ++i) {
    field.in("color_rgb", static_cast<std::size_t>(i)).require_at_least_zero(body.color_rgb(i), 1);
  }
}

/// A scene's default coupling: felt by hand, and calm.
void complete(wire::Anchor& anchor, const SceneField& field) {
  if (!anchor.has_stiffness_n_per_m()) anchor.set_stiffness_n_per_m(300);
  if (!anchor.has_damping_n_s_per_m()) anchor.set_damping_n_s_per_m(3);
  if (!anchor.has_stiffness_n_m_per_rad()) anchor.set_stiffness_n_m_per_rad(0.3);
  if (!anchor.has_damping_n_m_s_per_rad()) anchor.set_damping_n_m_s_per_rad(0.003);
  field.in("stiffness_n_per_m").require_at_least_zero(anchor.stiffness_n_per_m(), 1e5);
  field.in("damping_n_s_per_m").require_at_least_zero(anchor.damping_n_s_per_m(), 1e4);
  field.in("stiffness_n_m_per_rad").require_at_least_zero(anchor.stiffness_n_m_per_rad(), 1e4);
  field.in("damping_n_m_s_per_rad").require_at_least_zero(anchor.damping_n_m_s_per_rad(), 1e3);
}

void complete(wire::Body& body, const SceneField& field) {
  check_shape_count(body.shapes_size(), field.in("shapes"));
  for (int i = 0; i < body.shapes_size(); ++i) {
    complete(*body.mutable_shapes(i), field.in("shapes", static_cast<std::size_t>(i)));
  }
  check_molecule_stands_alone(body, field);
  field.in("mass_kg").require_within(body.mass_kg(), 0, kMaxMass_kg, "0 (static) or more, up to 10000");
  complete(*body.mutable_placement(), field.in("placement"));
  complete_surface(body, field);
  if (!body.has_linear_damping_per_s()) body.set_linear_damping_per_s(0);
  if (!body.has_angular_damping_per_s()) body.set_angular_damping_per_s(0);
  field.in("linear_damping_per_s").require_at_least_zero(body.linear_damping_per_s(), kMaxDamping_per_s);
  field.in("angular_damping_per_s").require_at_least_zero(body.angular_damping_per_s(), kMaxDamping_per_s);
  if (!body.has_gravity()) body.set_gravity(true);
  if (body.graspable() && body.mass_kg() <= 0) {
    field.in("graspable").refuse("is true; a static body cannot be held: give it a mass_kg, or leave graspable out");
  }
  if (!body.has_anchor()) return;
  if (body.mass_kg() <= 0) {
    field.in("anchor").refuse("is given; a static body stays where it is: give it a mass_kg, or leave anchor out");
  }
  complete(*body.mutable_anchor(), field.in("anchor"));
}

void complete_bodies(wire::Scene& scene, const SceneField& file) {
  const int count = scene.bodies_size();
  if (count == 0) file.in("bodies").refuse("is empty; a scene needs at least one body");
  if (count > static_cast<int>(proto::kMaxBodies)) {
    file.in("bodies").refuse("has " + std::to_string(count) + " bodies; at most " + std::to_string(proto::kMaxBodies) +
                             " are possible");
  }
  std::set<std::string> names;
  for (int i = 0; i < count; ++i) {
    const SceneField field = file.in("bodies", static_cast<std::size_t>(i));
    check_unique_name(scene.bodies(i).name(), names, field.in("name"));
    complete(*scene.mutable_bodies(i), field);
  }
}

void complete_workspace(wire::Tool& tool, const SceneField& field) {
  wire::Workspace& workspace = *tool.mutable_workspace();
  // So that the resting handle meets the tool where it starts.
  if (!workspace.has_device_base()) *workspace.mutable_device_base() = tool.placement();
  complete(*workspace.mutable_device_base(), field.in("device_base"));
  if (!workspace.has_position_scale()) workspace.set_position_scale(1);
  if (!workspace.has_force_scale()) workspace.set_force_scale(1);
  field.in("position_scale").require_positive(workspace.position_scale(), 1e3);
  field.in("force_scale").require_positive(workspace.force_scale(), 1e3);
}

void check_held_body(const wire::Scene& scene, const std::string& name, const SceneField& field) {
  if (name.empty()) return;
  const auto body = std::find_if(scene.bodies().begin(), scene.bodies().end(),
                                 [&name](const wire::Body& candidate) { return candidate.name() == name; });
  if (body == scene.bodies().end()) field.refuse("is \"" + name + "\"; there is no body of that name");
  if (body->mass_kg() <= 0) field.refuse("is \"" + name + "\", which is static (mass_kg 0); it must be able to move");
  if (!body->graspable()) field.refuse("is \"" + name + "\", which is not graspable; set graspable of that body");
}

void complete(wire::Tool& tool, const wire::Scene& scene, const SceneField& field) {
  complete(*tool.mutable_placement(), field.in("placement"));
  if (!tool.has_mass_kg()) tool.set_mass_kg(0.05);
  field.in("mass_kg").require_positive(tool.mass_kg(), kMaxMass_kg);
  if (tool.shapes().empty()) tool.add_shapes()->mutable_sphere()->set_radius_m(0.005);
  check_shape_count(tool.shapes_size(), field.in("shapes"));
  for (int i = 0; i < tool.shapes_size(); ++i) {
    const SceneField shape = field.in("shapes", static_cast<std::size_t>(i));
    complete(*tool.mutable_shapes(i), shape);
    if (tool.shapes(i).has_molecule()) {
      shape.in("molecule").refuse("is in a tool; make the molecule a body and let the tool hold it");
    }
  }
  check_held_body(scene, tool.holds(), field.in("holds"));
  complete_workspace(tool, field.in("workspace"));
  if (!tool.has_friction()) tool.set_friction(0.5);
  field.in("friction").require_at_least_zero(tool.friction(), 10);
  if (!tool.has_contact_stiffness_n_per_m3()) tool.set_contact_stiffness_n_per_m3(kDefaultContactStiffness_n_per_m3);
  complete_stiffness(tool.contact_stiffness_n_per_m3(), field);
}

void complete_tools(wire::Scene& scene, const SceneField& file) {
  const int count = scene.tools_size();
  if (count == 0) file.in("tools").refuse("is empty; a scene needs at least one tool");
  if (count > static_cast<int>(proto::kMaxUsers)) {
    file.in("tools").refuse("has " + std::to_string(count) + " tools; at most " + std::to_string(proto::kMaxUsers) +
                            " are possible");
  }
  std::set<std::string> names;
  for (int i = 0; i < count; ++i) {
    const SceneField field = file.in("tools", static_cast<std::size_t>(i));
    check_unique_name(scene.tools(i).name(), names, field.in("name"));
    complete(*scene.mutable_tools(i), scene, field);
  }
}

void complete_molecular_field(wire::Scene& scene, const SceneField& field) {
  const auto has_molecule = [](const wire::Body& body) { return body.shapes(0).has_molecule(); };
  const bool is_needed = std::any_of(scene.bodies().begin(), scene.bodies().end(), has_molecule);
  if (!is_needed && !scene.has_molecular_field()) return;
  wire::MolecularField& molecular = *scene.mutable_molecular_field();
  const docking::MolecularScale fallback;
  if (molecular.force_field_directory().empty()) molecular.set_force_field_directory(kDefaultForceFieldDirectory);
  if (!molecular.has_metres_per_angstrom()) molecular.set_metres_per_angstrom(fallback.metres_per_angstrom);
  if (!molecular.has_newtons_per_kcal_per_mol_angstrom()) {
    molecular.set_newtons_per_kcal_per_mol_angstrom(fallback.newtons_per_kcal_per_mol_angstrom);
  }
  if (!molecular.has_force_limit_n()) molecular.set_force_limit_n(20);
  field.in("metres_per_angstrom").require_positive(molecular.metres_per_angstrom(), 1);
  field.in("newtons_per_kcal_per_mol_angstrom").require_positive(molecular.newtons_per_kcal_per_mol_angstrom(), 1000);
  field.in("force_limit_n").require_positive(molecular.force_limit_n(), 1000);
}

void complete_limits(wire::Scene& scene, const SceneField& field) {
  wire::Limits& limits = *scene.mutable_limits();
  const auto tools = static_cast<std::uint32_t>(scene.tools_size());
  if (!limits.has_manipulators()) limits.set_manipulators(tools);
  field.in("manipulators").require_within(limits.manipulators(), 1, tools, "from 1 to the number of tools");
  const std::uint32_t seats = static_cast<std::uint32_t>(proto::kMaxUsers) - limits.manipulators();
  if (!limits.has_observers()) limits.set_observers(std::min(4U, seats));
  field.in("observers")
      .require_within(limits.observers(), 0, seats,
                      "at most " + std::to_string(proto::kMaxUsers) + " less manipulators");
  if (!limits.has_body_speed_m_per_s()) limits.set_body_speed_m_per_s(10);
  if (!limits.has_grab_reach_m()) limits.set_grab_reach_m(0.02);
  field.in("body_speed_m_per_s").require_positive(limits.body_speed_m_per_s(), 1000);
  field.in("grab_reach_m").require_at_least_zero(limits.grab_reach_m(), 10);
  if (!limits.has_contact_points()) limits.set_contact_points(2048);
  if (!limits.has_contact_pairs()) limits.set_contact_pairs(64);
  field.in("contact_points").require_within(limits.contact_points(), 256, 65536, "from 256 to 65536");
  field.in("contact_pairs").require_within(limits.contact_pairs(), 1, 256, "from 1 to 256");
  const double product = static_cast<double>(limits.contact_points()) * limits.contact_pairs();
  field.in("contact_points")
      .require_within(
          product, 0, kMaxContactPoints,
          "times contact_pairs at most " + number_text(kMaxContactPoints) + ", so that the memory suffices");
}

}  // namespace

void check_unique_name(const std::string& name, std::set<std::string>& taken, const SceneField& field) {
  check_name(name, field);
  if (!taken.insert(name).second) field.refuse("is \"" + name + "\", which is taken; names must be unique");
}

void complete(wire::Placement& placement, const SceneField& field) {
  field.in("position_m").complete_vec3(*placement.mutable_position_m(), Vec3::Zero(), kMaxPosition_m);
  field.in("rotation_xyz_deg").complete_vec3(*placement.mutable_rotation_xyz_deg(), Vec3::Zero(), 360);
}

void check(wire::Mesh& mesh, const SceneField& field) {
  if (mesh.file().empty()) field.in("file").refuse("is empty; name a mesh file");
  field.in("scale").require_at_least_zero(mesh.scale(), 1e6);
  field.in("largest_size_m").require_at_least_zero(mesh.largest_size_m(), kMaxSize_m);
  if (mesh.scale() > 0 && mesh.largest_size_m() > 0) {
    field.refuse("has both scale and largest_size_m; give one of them");
  }
  if (mesh.largest_size_m() <= 0 && mesh.scale() <= 0) mesh.set_scale(1);
  if (!mesh.has_sheet_thickness_m()) mesh.set_sheet_thickness_m(1e-3);
  field.in("sheet_thickness_m").require_within(mesh.sheet_thickness_m(), 2e-4, 0.1, "from 0.0002 to 0.1");
  if (!mesh.contact_sha256().empty()) field.in("contact_sha256").refuse("is the server's to set; leave it out");
}

void complete_and_check(wire::Scene& scene, const SceneField& file) {
  check_name(scene.name(), file.in("name"));
  if (scene.description().size() > kMaxDescriptionBytes) {
    file.in("description")
        .refuse("is too long; it must have at most " + std::to_string(kMaxDescriptionBytes) + " bytes");
  }
  complete_bodies(scene, file);
  complete_tools(scene, file);
  complete_coupling(*scene.mutable_coupling(), file);
  complete_molecular_field(scene, file.in("molecular_field"));
  complete_limits(scene, file.in("limits"));
  file.in("gravity_m_per_s2").complete_vec3(*scene.mutable_gravity_m_per_s2(), Vec3(0, 0, -9.81), kMaxGravity_m_per_s2);
  if (!scene.has_step_rate_hz()) scene.set_step_rate_hz(1000);
  file.in("step_rate_hz").require_within(scene.step_rate_hz(), 60, 4000, "from 60 to 4000");
  complete_soft_bodies(scene, file);
  complete_effects(scene, file);
}

}  // namespace tandem::server

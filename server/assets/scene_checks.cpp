#include "server/assets/scene_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "proto/effects_from_wire.hpp"
#include "proto/state.hpp"
#include "proto/world_from_wire.hpp"
#include "server/assets/scene_coupling.hpp"
#include "server/assets/scene_effects.hpp"
#include "server/assets/scene_goals.hpp"
#include "server/assets/scene_soft_checks.hpp"
#include "server/assets/structures/loader.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxNameBytes = 64;
constexpr std::size_t kMaxDescriptionBytes = 2000;
constexpr double kMaxContactPoints = 1 << 20U;  // limit of a room; a point takes about 1 KiB
constexpr std::uint32_t kDefaultObservers = 4;
constexpr double kDefaultBounds_m = 10;

using Shapes = google::protobuf::RepeatedPtrField<wire::Shape>;

void complete(Shapes& shapes) {
  for (wire::Shape& shape : shapes) {
    shape.mutable_placement();
    if (shape.has_mesh()) complete_mesh(*shape.mutable_mesh());
  }
}

void complete(wire::Tool& tool) {
  tool.mutable_placement();
  if (tool.shapes().empty()) tool.add_shapes()->mutable_sphere()->set_radius_m(0.005);
  complete(*tool.mutable_shapes());
  wire::Workspace& workspace = *tool.mutable_workspace();
  // By default, the base of the device is placed such that a handle at rest coincides with the tool's initial pose.
  if (!workspace.has_device_base()) *workspace.mutable_device_base() = tool.placement();
}

void complete_molecular_field(wire::Scene& scene) {
  const auto is_molecule = [](const wire::Shape& shape) { return shape.has_molecule(); };
  const auto has_molecule = [&](const wire::Body& body) {
    return std::any_of(body.shapes().begin(), body.shapes().end(), is_molecule);
  };
  const bool is_needed = std::any_of(scene.bodies().begin(), scene.bodies().end(), has_molecule);
  if (!is_needed && !scene.has_molecular_field()) return;
  wire::MolecularField& molecular = *scene.mutable_molecular_field();
  if (molecular.force_field_directory().empty()) molecular.set_force_field_directory(default_force_field());
  if (molecular.dielectric().empty()) molecular.set_dielectric(kDefaultDielectric);
}

/// Largest distance from the origin at which a body or tool starts.
double farthest_start_m(const wire::Scene& scene) {
  double farthest_m = 0;
  const auto note_distance = [&farthest_m](const wire::Placement& placement) {
    double squared = 0;
    for (const double x : placement.position_m()) squared += x * x;
    farthest_m = std::max(farthest_m, std::sqrt(squared));
  };
  for (const wire::Body& body : scene.bodies()) note_distance(body.placement());
  for (const wire::Tool& tool : scene.tools()) note_distance(tool.placement());
  return farthest_m;
}

void complete_limits(wire::Scene& scene) {
  wire::Limits& limits = *scene.mutable_limits();
  constexpr auto kUsers = static_cast<std::uint32_t>(proto::kMaxUsers);
  const auto tools = static_cast<std::uint32_t>(scene.tools_size());
  if (!limits.has_manipulators()) limits.set_manipulators(std::clamp(tools, 1U, kUsers));
  const std::uint32_t seats = kUsers - std::min(limits.manipulators(), kUsers);
  if (!limits.has_observers()) limits.set_observers(std::min(kDefaultObservers, seats));
  if (!limits.has_bounds_m()) limits.set_bounds_m(std::max(kDefaultBounds_m, 2 * farthest_start_m(scene)));
}

/// Adds every missing sub-message, and the defaults that the table of ranges (proto/scene_ranges.hpp) lacks. It lacks
/// defaults that are not numbers, and defaults that depend on other fields.
void complete(wire::Scene& scene) {
  for (wire::Body& body : *scene.mutable_bodies()) {
    body.mutable_placement();
    complete(*body.mutable_shapes());
    if (!body.has_gravity()) body.set_gravity(true);
  }
  for (wire::Tool& tool : *scene.mutable_tools()) complete(tool);
  complete_coupling(*scene.mutable_coupling());
  complete_molecular_field(scene);
  complete_limits(scene);
  complete_soft_bodies(scene);
  complete_effects(scene);
  complete_goals(scene);
}

void check_name(const std::string& name, const SceneField& field) {
  if (name.empty()) field.refuse("is empty; give it a name");
  if (name.size() > kMaxNameBytes) {
    field.refuse("has " + std::to_string(name.size()) + " bytes; it must have at most " +
                 std::to_string(kMaxNameBytes));
  }
}

void check(const wire::Shape& shape, const SceneField& field) {
  if (shape.kind_case() == wire::Shape::KIND_NOT_SET) {
    field.refuse("has no kind; it must have one of sphere, box, cylinder, capsule, mesh, molecule");
  }
  if (shape.has_mesh()) check_mesh(shape.mesh(), field.in("mesh"));
  if (!shape.has_molecule()) return;
  const SceneField molecule = field.in("molecule");
  if (shape.molecule().file().empty()) molecule.in("file").refuse("is empty; name a structure file");
  try {
    hydrogens_of(shape.molecule().hydrogens());
  } catch (const std::invalid_argument& error) {
    molecule.refuse(error.what());
  }
  if (!shape.molecule().asset_sha256().empty()) {
    molecule.in("asset_sha256").refuse("is the server's to set; leave it out");
  }
}

/// Checks the shapes of a body or a tool, and their number.
/// In      field  field of the object that has the shapes
void check(const Shapes& shapes, const SceneField& field) {
  if (shapes.empty()) field.in("shapes").refuse("is empty; at least one shape is needed");
  if (shapes.size() > proto::kMaxShapes) {
    field.in("shapes").refuse("has " + std::to_string(shapes.size()) + " shapes; at most " +
                              std::to_string(proto::kMaxShapes) + " are possible");
  }
  for (int i = 0; i < shapes.size(); ++i) check(shapes[i], field.in("shapes", static_cast<std::size_t>(i)));
}

/// Requires that a molecule is the only shape of its body and has no placement. The body's origin must be the
/// molecule's centre of mass, and the inertia is that of the atoms.
void check_molecule_stands_alone(const wire::Body& body, const SceneField& field) {
  for (int i = 0; i < body.shapes_size(); ++i) {
    if (!body.shapes(i).has_molecule()) continue;
    const SceneField shape = field.in("shapes", static_cast<std::size_t>(i));
    if (body.shapes_size() > 1)
      shape.in("molecule").refuse("is one of several shapes; a molecule must be its body's only shape");
    const wire::Placement& placement = body.shapes(i).placement();
    const auto is_zero = [](double value) { return value == 0; };
    if (!std::all_of(placement.position_m().begin(), placement.position_m().end(), is_zero) ||
        !std::all_of(placement.rotation_xyz_deg().begin(), placement.rotation_xyz_deg().end(), is_zero)) {
      shape.in("placement").refuse("is not zero; a molecule's centre of mass is its body's origin: place the body");
    }
  }
}

void check(const wire::Body& body, const SceneField& field) {
  check(body.shapes(), field);
  check_molecule_stands_alone(body, field);
  if (body.mass_kg() > 0) return;
  if (body.graspable()) {
    field.in("graspable").refuse("is true; a static body cannot be held: give it a mass_kg, or leave graspable out");
  }
  if (body.has_anchor()) {
    field.in("anchor").refuse("is given; a static body stays where it is: give it a mass_kg, or leave anchor out");
  }
}

void check_bodies(const wire::Scene& scene, const SceneField& file) {
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
    check(scene.bodies(i), field);
  }
}

void check_held_body(const wire::Scene& scene, const std::string& name, const SceneField& field) {
  if (name.empty()) return;
  const auto body = std::find_if(scene.bodies().begin(), scene.bodies().end(),
                                 [&name](const wire::Body& candidate) { return candidate.name() == name; });
  if (body == scene.bodies().end()) field.refuse("is \"" + name + "\"; there is no body of that name");
  if (body->mass_kg() <= 0) field.refuse("is \"" + name + "\", which is static (mass_kg 0); it must be able to move");
  if (!body->graspable()) field.refuse("is \"" + name + "\", which is not graspable; set graspable of that body");
}

void check(const wire::Tool& tool, const wire::Scene& scene, const SceneField& field) {
  check(tool.shapes(), field);
  for (int i = 0; i < tool.shapes_size(); ++i) {
    if (!tool.shapes(i).has_molecule()) continue;
    field.in("shapes", static_cast<std::size_t>(i))
        .in("molecule")
        .refuse("is in a tool; make the molecule a body and let the tool hold it");
  }
  check_held_body(scene, tool.holds(), field.in("holds"));
}

void check_tools(const wire::Scene& scene, const SceneField& file) {
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
    check(scene.tools(i), scene, field);
  }
}

void check_limits(const wire::Scene& scene, const SceneField& field) {
  const wire::Limits& limits = scene.limits();
  field.in("manipulators")
      .require_within(limits.manipulators(), 1, scene.tools_size(), "from 1 to the number of tools");
  const std::uint32_t seats = static_cast<std::uint32_t>(proto::kMaxUsers) - limits.manipulators();
  field.in("observers")
      .require_within(limits.observers(), 0, seats,
                      "at most " + std::to_string(proto::kMaxUsers) + " less manipulators");
  const double product = static_cast<double>(limits.contact_points()) * limits.contact_pairs();
  field.in("contact_points")
      .require_within(
          product, 0, kMaxContactPoints,
          "times contact_pairs at most " + number_text(kMaxContactPoints) + ", so that the memory suffices");
  if (!(farthest_start_m(scene) < limits.bounds_m())) {
    field.in("bounds_m")
        .refuse("is " + number_text(limits.bounds_m()) + " m, and a body or tool starts " +
                number_text(farthest_start_m(scene)) + " m from the origin; it must be more than that");
  }
}

}  // namespace

void check_unique_name(const std::string& name, std::set<std::string>& taken, const SceneField& field) {
  check_name(name, field);
  if (!taken.insert(name).second) field.refuse("is \"" + name + "\", which is taken; names must be unique");
}

void complete_mesh(wire::Mesh& mesh) {
  if (mesh.scale() == 0 && mesh.largest_size_m() == 0) mesh.set_scale(1);
}

void check_mesh(const wire::Mesh& mesh, const SceneField& field) {
  if (mesh.file().empty()) field.in("file").refuse("is empty; name a mesh file");
  if (mesh.scale() > 0 && mesh.largest_size_m() > 0) {
    field.refuse("has both scale and largest_size_m; give one of them");
  }
  if (!mesh.contact_sha256().empty()) field.in("contact_sha256").refuse("is the server's to set; leave it out");
  if (!mesh.surface_sha256().empty()) field.in("surface_sha256").refuse("is the server's to set; leave it out");
}

void complete_and_check(wire::Scene& scene, const SceneField& file) {
  complete(scene);
  proto::complete_numbers(scene);
  if (const std::string problem = proto::find_range_problem(scene); !problem.empty()) file.refuse(problem);
  check_name(scene.name(), file.in("name"));
  if (scene.description().size() > kMaxDescriptionBytes) {
    file.in("description")
        .refuse("is too long; it must have at most " + std::to_string(kMaxDescriptionBytes) + " bytes");
  }
  check_bodies(scene, file);
  check_tools(scene, file);
  check_coupling(scene.coupling(), file);
  check_limits(scene, file.in("limits"));
  check_soft_bodies(scene, file);
  check_goals(scene, file);
  if (const std::string problem = proto::find_effect_problem(scene); !problem.empty()) file.refuse(problem);
  if (const std::string problem = proto::find_molecular_problem(scene); !problem.empty()) file.refuse(problem);
}

}  // namespace tandem::server

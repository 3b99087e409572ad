#include "proto/world_from_wire.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/effects_from_wire.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"
#include "proto/state.hpp"

namespace tandem::proto {
namespace {

physics::BodyDescription body_from_wire(const wire::Body& body) {
  physics::BodyDescription result;
  result.traits = {body.friction(), body.restitution(), body.linear_damping_per_s(), body.angular_damping_per_s(),
                   body.gravity()};
  result.X_WB = pose_from_placement(body.placement());
  result.is_graspable = body.graspable() && body.mass_kg() > 0;
  if (body.has_anchor() && body.mass_kg() > 0) {
    const wire::Anchor& anchor = body.anchor();
    result.anchor = physics::Joint{anchor.stiffness_n_per_m(), anchor.damping_n_s_per_m(),
                                   anchor.stiffness_n_m_per_rad(), anchor.damping_n_m_s_per_rad()};
  }
  return result;
}

physics::ToolDescription tool_from_wire(const wire::Tool& tool, const wire::Scene& scene) {
  physics::ToolDescription result;
  result.friction = tool.friction();
  result.X_WT = pose_from_placement(tool.placement());
  const auto& bodies = scene.bodies();
  const auto held = std::find_if(bodies.begin(), bodies.end(),
                                 [&tool](const wire::Body& body) { return body.name() == tool.holds(); });
  if (held != bodies.end()) result.holds_body = static_cast<std::size_t>(held - bodies.begin());
  return result;
}

docking::FieldModel field_model_of(const wire::MolecularField& field) {
  docking::FieldModel model;
  docking::set_dielectric(model, field.dielectric());
  model.cutoff_angstrom = field.cutoff_angstrom();
  model.has_far_grid = field.far_grid();
  docking::validate(model);
  return model;
}

void set_molecular_field(const wire::MolecularField& field, physics::WorldDescription& world) {
  world.metres_per_angstrom = field.metres_per_angstrom();
  world.newtons_per_kcal_per_mol_angstrom = field.newtons_per_kcal_per_mol_angstrom();
  world.molecular_force_limit_n = field.force_limit_n();
  world.field_model = field_model_of(field);
  world.molecular_zero_kt = field.zero_area_kt();
  world.molecular_knee_kcal_per_mol = field.knee_kcal_per_mol();
  world.molecular_minimum_kcal_per_mol = field.minimum_kcal_per_mol();
}

physics::WorldLimits limits_from_wire(const wire::Limits& limits) {
  return {limits.body_speed_m_per_s(), limits.grab_reach_m(), limits.contact_points(), limits.contact_pairs(),
          limits.atom_pairs(),         limits.bounds_m(),     limits.reset_after_s()};
}

}  // namespace

std::string find_molecular_problem(const wire::Scene& scene, const std::string& path) {
  if (!scene.has_molecular_field()) return {};
  try {
    field_model_of(scene.molecular_field());
  } catch (const std::invalid_argument& error) {
    return (path.empty() ? "" : path + ".") + "molecular_field: " + error.what();
  }
  // A grid belongs to two molecules. It takes 64 MB of memory and about a second to compute, so only one is allowed.
  const auto molecules = std::ranges::count_if(
      scene.bodies(), [](const wire::Body& body) { return body.shapes_size() > 0 && body.shapes(0).has_molecule(); });
  if (scene.molecular_field().far_grid() && molecules > 2) {
    return (path.empty() ? "" : path + ".") + "molecular_field.far_grid is of two molecules; leave it out here";
  }
  return {};
}

std::string find_mass_problem(const wire::MassProperties& message, const std::string& path) {
  if (std::string problem = find_range_problem(message, path); !problem.empty() || message.mass_kg() == 0) {
    return problem;
  }
  const auto& centre = message.centre();
  const int moments = message.principal_inertia_kg_m2_size();
  if (centre.size() != 7) return path + ".centre has " + std::to_string(centre.size()) + " numbers; it must have 7";
  if (moments != 3) {
    return path + ".principal_inertia_kg_m2 has " + std::to_string(moments) + " numbers; it must have 3";
  }
  const double norm = Quat(centre[3], centre[4], centre[5], centre[6]).norm();
  if (std::abs(norm - 1) <= kMaxQuaternionError) return {};
  return path + ".centre has a quaternion of length " + number_text(norm) + "; it must be 1";
}

std::optional<MassProperties> mass_from_wire(const wire::MassProperties& message) {
  if (!find_mass_problem(message, "mass").empty()) return std::nullopt;
  MassProperties mass;
  mass.mass_kg = message.mass_kg();
  if (mass.mass_kg == 0) return mass;
  const auto& centre = message.centre();
  const auto& inertia = message.principal_inertia_kg_m2();
  mass.X_BC = {{centre[0], centre[1], centre[2]}, Quat(centre[3], centre[4], centre[5], centre[6])};
  mass.X_BC.q.normalize();
  mass.principal_inertia_kg_m2 = {inertia[0], inertia[1], inertia[2]};
  return mass;
}

physics::WorldDescription world_from_wire(const wire::Scene& scene) {
  physics::WorldDescription world;
  if (scene.gravity_m_per_s2_size() == 3) {
    world.gravity_m_per_s2 = {scene.gravity_m_per_s2(0), scene.gravity_m_per_s2(1), scene.gravity_m_per_s2(2)};
  }
  world.step_s = 1.0 / scene.step_rate_hz();
  world.limits = limits_from_wire(scene.limits());
  for (const wire::Body& body : scene.bodies()) world.bodies.push_back(body_from_wire(body));
  for (const wire::Tool& tool : scene.tools()) world.tools.push_back(tool_from_wire(tool, scene));
  for (const CouplingField& field : kCouplingFields) {
    world.coupling.parameters.*(field.value) = (scene.coupling().*field.get)();
  }
  if (const haptics::CouplingLawInfo* const law = haptics::find_coupling_law(scene.coupling().law())) {
    world.coupling.law = law->name;
    world.coupling.dynamics = law->tool;
  }
  if (scene.has_molecular_field()) set_molecular_field(scene.molecular_field(), world);
  world.effects = effects_of(scene);
  return world;
}

namespace {

/// Cache of the primitive shapes in use, by which rooms, clients and lab trials in one process share equal shapes.
class PrimitivesInUse {
 public:
  using Key = std::array<double, 4>;  ///< kind and sizes of a shape; all must be finite

  std::shared_ptr<const contact::ContactShape> find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto found = shapes_.find(key);
    return found != shapes_.end() ? found->second.lock() : nullptr;
  }
  void add(const Key& key, const std::shared_ptr<const contact::ContactShape>& shape) {
    const std::lock_guard lock(mutex_);
    std::erase_if(shapes_, [](const auto& entry) { return entry.second.expired(); });
    shapes_[key] = shape;
  }

 private:
  std::mutex mutex_;  // protects `shapes_`
  std::map<Key, std::weak_ptr<const contact::ContactShape>> shapes_;
};

PrimitivesInUse::Key key_of(const wire::Shape& shape) {
  const auto kind = static_cast<double>(shape.kind_case());
  switch (shape.kind_case()) {
    case wire::Shape::kSphere:
      return {kind, shape.sphere().radius_m()};
    case wire::Shape::kBox: {
      const auto& size = shape.box().size_m();
      return {kind, size[0], size[1], size[2]};
    }
    case wire::Shape::kCylinder:
      return {kind, shape.cylinder().radius_m(), shape.cylinder().length_m()};
    default:
      return {kind, shape.capsule().radius_m(), shape.capsule().length_m()};
  }
}

std::shared_ptr<const contact::ContactShape> made_primitive(const wire::Shape& shape) {
  switch (shape.kind_case()) {
    case wire::Shape::kSphere:
      return contact::make_contact_sphere(shape.sphere().radius_m());
    case wire::Shape::kBox: {
      const auto& size = shape.box().size_m();
      return contact::make_contact_box({size[0], size[1], size[2]});
    }
    case wire::Shape::kCylinder:
      return contact::make_contact_cylinder(shape.cylinder().radius_m(), shape.cylinder().length_m());
    default:
      return contact::make_contact_capsule(shape.capsule().radius_m(), shape.capsule().length_m());
  }
}

bool is_primitive(const wire::Shape& shape) {
  if (shape.has_box()) return shape.box().size_m_size() == 3;
  return shape.has_sphere() || shape.has_cylinder() || shape.has_capsule();
}

}  // namespace

std::shared_ptr<const contact::ContactShape> primitive_contact(const wire::Shape& shape) {
  static PrimitivesInUse in_use;
  if (!is_primitive(shape)) return nullptr;
  const PrimitivesInUse::Key key = key_of(shape);
  // A size that is not finite is no valid key of the map. It is passed on to the function below, which reports the
  // error.
  if (!std::ranges::all_of(key, [](double size) { return std::isfinite(size); })) return made_primitive(shape);
  if (auto known = in_use.find(key)) return known;
  auto made = made_primitive(shape);
  in_use.add(key, made);
  return made;
}

physics::TouchModel touch_model_of(std::vector<physics::TouchModel::Part> parts, double stiffness_n_per_m3) {
  physics::TouchModel model;
  model.stiffness_n_per_m3 = stiffness_n_per_m3;
  for (physics::TouchModel::Part& part : parts) {
    if (part.shape == nullptr) continue;
    model.radius_m = std::max(model.radius_m, part.X_BS.p.norm() + part.shape->radius_m());
    model.parts.push_back(std::move(part));
  }
  return model;
}

}  // namespace tandem::proto

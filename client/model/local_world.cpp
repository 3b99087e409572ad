#include "client/model/local_world.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/docking/molecule_asset.hpp"
#include "proto/placement.hpp"
#include "proto/state.hpp"
#include "proto/world_from_wire.hpp"

namespace tandem::client {
namespace {

/// What cannot be used; caught in make_local_world().
class Unusable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// As the server's own checks have it (proto/tandem/scene.proto), for this server may be another.
constexpr double kMaxMass_kg = 1e4;
constexpr double kMaxInertia_kg_m2 = 1e8;
constexpr double kMaxFriction = 10;
constexpr double kMaxRate_per_s = 1000;
constexpr double kMaxLength_m = 100;
constexpr double kMaxPlacement_m = 1e4;
constexpr double kMinSurface_n_per_m3 = 1e5;
constexpr double kMaxSurface_n_per_m3 = 1e13;
constexpr double kMaxGravity_m_per_s2 = 1e3;
constexpr std::size_t kMaxShapes = 256;

void require(bool is_fine, const std::string& field, double value) {
  if (!is_fine) throw Unusable(field + " is " + std::to_string(value));
}

void require_within(double value, double low, double high, const std::string& field) {
  require(std::isfinite(value) && value >= low && value <= high, field, value);
}

void require_pose(const Pose& pose, const std::string& field) {
  require(is_finite(pose) && pose.p.cwiseAbs().maxCoeff() <= kMaxPlacement_m, field, pose.p.norm());
}

std::optional<proto::Sha256> hash_of(const std::string& bytes) {
  proto::Sha256 hash{};
  if (bytes.size() != hash.size()) return std::nullopt;
  std::copy_n(std::as_bytes(std::span(bytes)).begin(), hash.size(), hash.begin());
  return hash;
}

const std::string& needed_hash(const wire::Shape& shape) {
  return shape.has_mesh() ? shape.mesh().contact_sha256() : shape.molecule().asset_sha256();
}

class Builder {
 public:
  Builder(const wire::Joined& joined, const AssetMap& assets) : joined_(joined), assets_(assets) {}

  std::shared_ptr<const physics::WorldDescription> build() {
    const wire::Scene& scene = joined_.scene();
    require(joined_.body_masses_size() == scene.bodies_size(), "body_masses", joined_.body_masses_size());
    require(joined_.tool_masses_size() == scene.tools_size(), "tool_masses", joined_.tool_masses_size());
    require_within(scene.step_rate_hz(), 60, 4000, "scene.step_rate_hz");
    world_ = proto::world_from_wire(scene);
    check_scene();
    for (int i = 0; i < scene.bodies_size(); ++i) add_body(i);
    for (int i = 0; i < scene.tools_size(); ++i) add_tool(i);
    return std::make_shared<const physics::WorldDescription>(std::move(world_));
  }

 private:
  void check_scene() const {
    require_within(world_.gravity_m_per_s2.norm(), 0, kMaxGravity_m_per_s2, "scene.gravity_m_per_s2");
    require_within(world_.limits.body_speed_m_per_s, 1e-6, 1000, "scene.limits.body_speed_m_per_s");
    require_within(world_.limits.grab_reach_m, 0, 10, "scene.limits.grab_reach_m");
    require_within(static_cast<double>(world_.limits.contact_points), 256, 65536, "scene.limits.contact_points");
    require_within(static_cast<double>(world_.limits.contact_pairs), 1, 256, "scene.limits.contact_pairs");
    for (const physics::EffectSettings& effect : world_.effects) {
      if (const auto problem = physics::find_problem(effect)) {
        throw Unusable("scene.effects: " + std::string(problem->field) + " is " + problem->value);
      }
    }
  }

  static MassProperties mass_from(const wire::MassProperties& message, const std::string& field) {
    MassProperties mass;
    mass.mass_kg = message.mass_kg();
    require_within(mass.mass_kg, 0, kMaxMass_kg, field + ".mass_kg");
    if (mass.mass_kg <= 0) return mass;
    const auto& centre = message.centre();
    const auto& inertia = message.principal_inertia_kg_m2();
    if (centre.size() != 7 || inertia.size() != 3) throw Unusable(field + " lacks its centre or its inertia");
    mass.X_BC = {{centre[0], centre[1], centre[2]}, Quat(centre[3], centre[4], centre[5], centre[6])};
    require_pose(mass.X_BC, field + ".centre");
    require_within(mass.X_BC.q.norm(), 1 - proto::kMaxQuaternionError, 1 + proto::kMaxQuaternionError,
                   field + ".centre");
    mass.X_BC.q.normalize();
    mass.principal_inertia_kg_m2 = {inertia[0], inertia[1], inertia[2]};
    for (const double moment : inertia) require_within(moment, 1e-15, kMaxInertia_kg_m2, field + ".principal_inertia");
    return mass;
  }

  void add_body(int index) {
    const wire::Body& message = joined_.scene().bodies(index);
    const std::string field = "scene.bodies[" + std::to_string(index) + "]";
    physics::BodyDescription& body = world_.bodies[static_cast<std::size_t>(index)];
    require_pose(body.X_WB, field + ".placement");
    check_traits(body.traits, field);
    if (body.anchor && !physics::is_usable(*body.anchor))
      throw Unusable(field + ".anchor has a number that is not usable");
    body.mass = mass_from(joined_.body_masses(index), field);
    if (message.shapes_size() == 1 && message.shapes(0).has_molecule()) {
      body.molecule = molecule(message.shapes(0), field);
    } else {
      body.touch = touch(message.shapes(), message.contact_stiffness_n_per_m3(), field);
    }
  }

  void add_tool(int index) {
    const wire::Tool& message = joined_.scene().tools(index);
    const std::string field = "scene.tools[" + std::to_string(index) + "]";
    physics::ToolDescription& tool = world_.tools[static_cast<std::size_t>(index)];
    require_pose(tool.X_WT, field + ".placement");
    require_within(tool.friction, 0, kMaxFriction, field + ".friction");
    tool.mass = mass_from(joined_.tool_masses(index), field);
    require(tool.mass.mass_kg > 0, field + ".mass_kg", tool.mass.mass_kg);
    tool.touch = touch(message.shapes(), message.contact_stiffness_n_per_m3(), field);
  }

  static void check_traits(const physics::BodyTraits& traits, const std::string& field) {
    require_within(traits.friction, 0, kMaxFriction, field + ".friction");
    require_within(traits.restitution, 0, 1, field + ".restitution");
    require_within(traits.linear_damping_per_s, 0, kMaxRate_per_s, field + ".linear_damping_per_s");
    require_within(traits.angular_damping_per_s, 0, kMaxRate_per_s, field + ".angular_damping_per_s");
  }

  physics::TouchModel touch(const google::protobuf::RepeatedPtrField<wire::Shape>& shapes, double stiffness_n_per_m3,
                            const std::string& field) {
    require_within(stiffness_n_per_m3, kMinSurface_n_per_m3, kMaxSurface_n_per_m3, field + ".contact_stiffness");
    require_within(shapes.size(), 1, kMaxShapes, field + ".shapes");
    std::vector<physics::TouchModel::Part> parts;
    for (const wire::Shape& shape : shapes) {
      const Pose X_BS = proto::pose_from_placement(shape.placement());
      require_pose(X_BS, field + ".shapes.placement");
      parts.push_back({contact(shape, field), X_BS});
    }
    return proto::touch_model_of(std::move(parts), stiffness_n_per_m3);
  }

  /// Shapes that are alike are made once.
  std::shared_ptr<const contact::ContactShape> contact(const wire::Shape& shape, const std::string& field) {
    wire::Shape key = shape;
    key.clear_placement();
    std::shared_ptr<const contact::ContactShape>& made = contacts_[key.SerializeAsString()];
    if (made != nullptr) return made;
    if (shape.has_mesh()) {
      const proto::Bytes& bytes = asset(shape, field);
      made = contact::contact_shape_from(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
    } else {
      check_lengths(shape, field);
      made = proto::primitive_contact(shape);
    }
    if (made == nullptr) throw Unusable(field + ".shapes has one that this client cannot touch");
    return made;
  }

  static void check_lengths(const wire::Shape& shape, const std::string& field) {
    const std::string name = field + ".shapes";
    const auto check = [&name](double length) { require_within(length, 1e-6, kMaxLength_m, name); };
    for (const double edge : shape.box().size_m()) check(edge);
    if (shape.has_sphere()) check(shape.sphere().radius_m());
    if (shape.has_cylinder()) check(shape.cylinder().radius_m()), check(shape.cylinder().length_m());
    if (shape.has_capsule()) check(shape.capsule().radius_m()), check(shape.capsule().length_m());
  }

  std::shared_ptr<const docking::Molecule> molecule(const wire::Shape& shape, const std::string& field) const {
    const double scale = world_.molecular_scale.metres_per_angstrom;
    require_within(scale, 1e-9, 1, "scene.molecular_field.metres_per_angstrom");
    require_within(world_.molecular_scale.newtons_per_kcal_per_mol_angstrom, 1e-12, 1000,
                   "scene.molecular_field.newtons_per_kcal_per_mol_angstrom");
    require_within(world_.molecular_force_limit_n, 1e-6, 1000, "scene.molecular_field.force_limit_n");
    auto made = docking::molecule_from(asset(shape, field));
    if (!made) throw Unusable(field + ".shapes[0].molecule: its asset cannot be read");
    return std::make_shared<const docking::Molecule>(std::move(*made));
  }

  const proto::Bytes& asset(const wire::Shape& shape, const std::string& field) const {
    const auto hash = hash_of(needed_hash(shape));
    const auto found = hash ? assets_.find(*hash) : assets_.end();
    if (found == assets_.end()) throw Unusable(field + ".shapes: an asset is not here");
    return *found->second;
  }

  const wire::Joined& joined_;
  const AssetMap& assets_;
  physics::WorldDescription world_;
  std::map<std::string, std::shared_ptr<const contact::ContactShape>> contacts_;
};

}  // namespace

LocalWorld make_local_world(const wire::Joined& joined, const AssetMap& assets) {
  LocalWorld result;
  result.tool = joined.tool();
  try {
    result.description = Builder(joined, assets).build();
    if (result.tool >= result.description->tools.size()) throw Unusable("tool is " + std::to_string(result.tool));
  } catch (const std::exception& error) {
    result.description = nullptr;
    result.problem = error.what();
  }
  return result;
}

}  // namespace tandem::client

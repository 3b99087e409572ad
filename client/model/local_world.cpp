#include "client/model/local_world.hpp"

#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/base/progress.hpp"
#include "common/docking/molecule_asset.hpp"
#include "common/physics/followed_bodies.hpp"
#include "common/physics/world.hpp"
#include "proto/effects_from_wire.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"
#include "proto/world_from_wire.hpp"

namespace tandem::client {
namespace {

void require(bool is_fine, const std::string& field, double value, const std::string& demand) {
  if (!is_fine) throw std::runtime_error(field + " is " + proto::number_text(value) + "; it must be " + demand);
}

void require_none(const std::string& problem) {
  if (!problem.empty()) throw std::runtime_error(problem);
}

const std::string& needed_hash(const wire::Shape& shape) {
  return shape.has_mesh() ? shape.mesh().contact_sha256() : shape.molecule().asset_sha256();
}

class Builder {
 public:
  Builder(const wire::Joined& joined, const AssetMap& assets, const ContactShapes& known)
      : joined_(joined), assets_(assets), known_(known) {}

  std::shared_ptr<const physics::WorldDescription> build() {
    const wire::Scene& scene = joined_.scene();
    require(joined_.body_masses_size() == scene.bodies_size(), "the number of body_masses", joined_.body_masses_size(),
            "that of scene.bodies");
    require(joined_.tool_masses_size() == scene.tools_size(), "the number of tool_masses", joined_.tool_masses_size(),
            "that of scene.tools");
    require(joined_.tool() < static_cast<std::uint32_t>(scene.tools_size()), "tool", joined_.tool(),
            "less than the number of scene.tools");
    if (!scene.has_limits()) throw std::runtime_error("scene.limits is absent");
    require_none(proto::find_range_problem(scene, "scene"));
    if (const std::string problem = proto::find_effect_problem(scene); !problem.empty()) {
      throw std::runtime_error("scene." + problem);
    }
    require_none(proto::find_molecular_problem(scene, "scene"));
    world_ = proto::world_from_wire(scene);
    for (int i = 0; i < scene.bodies_size(); ++i) add_body(i);
    for (int i = 0; i < scene.tools_size(); ++i) add_tool(i);
    return std::make_shared<const physics::WorldDescription>(std::move(world_));
  }
  ContactShapes release_shapes() { return std::move(contacts_); }

 private:
  static MassProperties mass_of(const wire::MassProperties& message, const std::string& path) {
    require_none(proto::find_mass_problem(message, path));
    return *proto::mass_from_wire(message);
  }

  void add_body(int index) {
    const wire::Body& message = joined_.scene().bodies(index);
    const std::string field = "scene.bodies[" + std::to_string(index) + "]";
    physics::BodyDescription& body = world_.bodies[static_cast<std::size_t>(index)];
    body.mass = mass_of(joined_.body_masses(index), "body_masses[" + std::to_string(index) + "]");
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
    const std::string mass_field = "tool_masses[" + std::to_string(index) + "]";
    tool.mass = mass_of(joined_.tool_masses(index), mass_field);
    require(tool.mass.mass_kg > 0, mass_field + ".mass_kg", tool.mass.mass_kg, "more than 0");
    tool.touch = touch(message.shapes(), message.contact_stiffness_n_per_m3(), field);
  }

  physics::TouchModel touch(const google::protobuf::RepeatedPtrField<wire::Shape>& shapes, double stiffness_n_per_m3,
                            const std::string& field) {
    require(shapes.size() >= 1 && shapes.size() <= proto::kMaxShapes, "the number of " + field + ".shapes",
            shapes.size(), "from 1 to " + std::to_string(proto::kMaxShapes));
    std::vector<physics::TouchModel::Part> parts;
    for (const wire::Shape& shape : shapes) {
      call_off_point();
      parts.push_back({contact(shape, field), proto::pose_from_placement(shape.placement())});
    }
    return proto::touch_model_of(std::move(parts), stiffness_n_per_m3);
  }

  /// Returns the contact shape of a message. Equal shapes are built only once.
  std::shared_ptr<const contact::ContactShape> contact(const wire::Shape& shape, const std::string& field) {
    wire::Shape key = shape;
    key.clear_placement();
    if (shape.has_mesh()) key.mutable_mesh()->set_contact_sha256(hash_here(shape));
    const std::string made_of = key.SerializeAsString();
    std::shared_ptr<const contact::ContactShape>& made = contacts_[made_of];
    if (made != nullptr) return made;
    if (const auto known = known_.find(made_of); known != known_.end()) {
      made = known->second;
    } else if (shape.has_mesh()) {
      made = contact::contact_shape_from(octets_of(asset(shape, field)));
    } else {
      made = proto::primitive_contact(shape);
    }
    if (made == nullptr) throw std::runtime_error(field + ".shapes has one that this client cannot touch");
    return made;
  }

  std::shared_ptr<const docking::Molecule> molecule(const wire::Shape& shape, const std::string& field) const {
    if (!joined_.scene().has_molecular_field()) throw std::runtime_error("scene.molecular_field is absent");
    call_off_point();
    auto made = docking::molecule_from(asset(shape, field));
    if (!made) throw std::runtime_error(field + ".shapes[0].molecule: its asset cannot be read");
    return std::make_shared<const docking::Molecule>(std::move(*made));
  }

  const proto::Bytes& asset(const wire::Shape& shape, const std::string& field) const {
    const proto::Bytes* const bytes = find_asset(assets_, hash_here(shape));
    if (bytes == nullptr) throw std::runtime_error(field + ".shapes: an asset is not here");
    return *bytes;
  }

  /// Returns the hash of the asset to build a shape from: that of the coarse asset if it has arrived and the full one
  /// has not, otherwise that of the full asset.
  const std::string& hash_here(const wire::Shape& shape) const {
    const std::string& hash = needed_hash(shape);
    const auto is_fine = [&hash](const wire::AssetInfo& info) {
      return info.sha256() == hash && info.kind() == "contact";
    };
    if (find_asset(assets_, hash) != nullptr || hash.empty()) return hash;
    if (std::ranges::none_of(joined_.assets(), is_fine)) return hash;
    for (const wire::AssetInfo& info : joined_.assets()) {
      if (info.kind() != "coarse-contact" || info.coarse_of() != hash) continue;
      if (find_asset(assets_, info.sha256()) != nullptr) return info.sha256();
    }
    return hash;
  }

  const wire::Joined& joined_;
  const AssetMap& assets_;
  physics::WorldDescription world_;
  const ContactShapes& known_;
  ContactShapes contacts_;
};

}  // namespace

std::shared_ptr<const physics::WorldDescription> make_local_world(const wire::Joined& joined, const AssetMap& assets,
                                                                  ContactShapes& shapes) {
  Builder builder(joined, assets, shapes);
  auto world = builder.build();
  shapes = builder.release_shapes();
  return world;
}

void require_in_time(const std::shared_ptr<const physics::WorldDescription>& description, Duration most) {
  call_off_point();
  physics::World world(description, physics::make_followed_bodies(description->bodies.size()), nullptr);
  for (std::size_t tool = 0; tool < description->tools.size(); ++tool) world.activate_tool(tool);
  call_off_point();
  const auto ms = [](Duration time) { return proto::number_text(to_seconds(time) * 1e3) + " ms"; };
  const Duration step = world.quickest_step();
  if (step <= most) return;
  throw std::runtime_error("a step of it takes " + ms(step) + " on this machine, and may take " + ms(most));
}

}  // namespace tandem::client

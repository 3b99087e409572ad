// Tools and hands in the world: activation, handles, couplings, and grabbing of bodies.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/haptics/coupling/coupling_ranges.hpp"
#include "common/physics/world_impl.hpp"

namespace tandem::physics {
namespace {

/// Largest overlap of a tool with a body at its release that counts as touching. With more overlap, the tool was inside
/// the body, and passes through it until both have separated.
constexpr double kPressedDepth_m = 2e-4;

}  // namespace

void World::Impl::attach(WorldTool& tool, std::size_t index, const Pose& X_BT) {
  change_owner(bodies[index], [](WorldBody& body) {
    ++body.hands;
    body.is_absent = false;
  });
  tool.soft = {};
  tool.passes_through.reset();
  tool.held = index;
  tool.X_BT = X_BT;
  couple(tool);
}

void World::Impl::detach(WorldTool& tool) {
  tool.rigid.set_state(tool_state(tool));
  tool.soft = {};
  WorldBody& body = bodies[*tool.held];
  // The released body stays in the touch stage for kAdoption_s. If no tool touches it until then, adopt() makes it
  // free.
  --body.hands;
  body.adopted = adoption_steps();
  const Pose X_WT = tool.rigid.pose(), X_WB = body.rigid.pose();
  if (overlaps(tool.description->touch, X_WT, body.description->touch, X_WB, kPressedDepth_m))
    tool.passes_through = tool.held;
  tool.held.reset();
  couple(tool);
}

haptics::CouplingParameters World::Impl::coupling_of(const WorldTool& tool) const {
  const RigidBody& moved = tool.held ? bodies[*tool.held].rigid : tool.rigid;
  const auto in_force = coupling_in_force(coupling, moved_mass(moved.mass(), tool.held.has_value()));
  return haptics::rendered_coupling(coupling.law, in_force, tool.coupling_bounds);
}

void World::Impl::couple(WorldTool& tool) const {
  tool.hand.set_coupling(*haptics::find_coupling_law(coupling.law), coupling_of(tool));
}

/// Returns the distance from the tool to the body's surface; for a molecule, from the tool's origin to the nearest
/// atom.
double World::Impl::distance_m(const WorldTool& tool, std::size_t index, double limit_m) const {
  const WorldBody& body = bodies[index];
  const Pose X_WT = tool.rigid.pose();
  const Pose X_WB = body.rigid.pose();
  if (body.molecule() == nullptr) {
    return physics::distance_m(tool.description->touch, X_WT, body.description->touch, X_WB, limit_m);
  }
  const double scale = scene->metres_per_angstrom;
  const Vec3 tool_B = X_WB.inverse() * X_WT.p;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& atom : body.molecule()->positions_angstrom) {
    nearest = std::min(nearest, (scale * atom - tool_B).norm());
  }
  return nearest;
}

void World::activate_tool(std::size_t index, bool takes_its_body) {
  WorldTool& tool = impl_->tools[index];
  if (tool.is_active) return;
  tool.is_active = true;
  tool.rigid.set_state(tool.start());
  const std::optional<std::size_t> held = impl_->scene->tools[index].holds_body;
  if (!held || !takes_its_body) return tool.hand.reset(impl_->coupling_of(tool));
  WorldBody& body = impl_->bodies[*held];
  if (body.hands == 0) body.rigid.set_state(body.start());
  impl_->attach(tool, *held, body.start().X.inverse() * tool.start().X);
  tool.hand.reset(impl_->coupling_of(tool));
  tool.hand.anchor_at(impl_->tool_state(tool).X);
}

void World::deactivate_tool(std::size_t index) {
  WorldTool& tool = impl_->tools[index];
  if (!tool.is_active) return;
  release(index);
  tool.passes_through.reset();
  tool.hand.release();
  tool.hand.set_brake(0);
  tool.soft = {};
  impl_->effects.forget(index);
  tool.coupling_bounds = haptics::kNoCouplingBounds;
  tool.is_active = false;
}

void World::set_handle(std::size_t tool, const RigidState& handle) {
  if (is_finite(handle.X) && is_finite(handle.V)) impl_->tools[tool].hand.set_handle(handle);
}

void World::brake(std::size_t index, double n_s_per_m) {
  if (std::isfinite(n_s_per_m) && n_s_per_m >= 0) impl_->tools[index].hand.set_brake(n_s_per_m);
}

void World::clear_handle(std::size_t index) {
  WorldTool& tool = impl_->tools[index];
  if (!tool.hand.has_handle()) return;
  if (tool.held) {
    tool.hand.anchor_at(impl_->tool_state(tool).X);
  } else {
    tool.hand.release();
  }
}

GrabResult World::grab(std::size_t index, BodyId id) {
  WorldTool& tool = impl_->tools[index];
  if (tool.held) return GrabResult::kAlreadyHolding;
  if (!tool.is_active) return GrabResult::kOutOfReach;
  if (id.value > impl_->bodies.size()) return GrabResult::kUnknownBody;
  if (id.is_valid() && !impl_->bodies[id.value - 1].description->is_graspable) return GrabResult::kNotGraspable;

  double nearest_m = impl_->scene->limits.grab_reach_m;
  std::optional<std::size_t> nearest;
  for (std::size_t i = 0; i < impl_->bodies.size(); ++i) {
    const WorldBody& body = impl_->bodies[i];
    if (!body.description->is_graspable || body.is_absent || (id.is_valid() && i + 1 != id.value)) continue;
    const double distance = impl_->distance_m(tool, i, nearest_m);
    // If two bodies are equally near, the first one in the scene is chosen.
    if (distance < nearest_m || (distance == nearest_m && !nearest)) {
      nearest_m = distance;
      nearest = i;
    }
  }
  if (!nearest) return GrabResult::kOutOfReach;
  const Pose X_WT = tool.rigid.pose();
  impl_->attach(tool, *nearest, impl_->bodies[*nearest].rigid.pose().inverse() * X_WT);
  if (!tool.hand.has_handle()) tool.hand.anchor_at(X_WT);
  return GrabResult::kGrabbed;
}

void World::hold(std::size_t index, BodyId id, const Pose& X_BT) {
  WorldTool& tool = impl_->tools[index];
  const WorldBody* const body = impl_->body_of(id);
  if (!tool.is_active || body == nullptr || body->rigid.is_static() || !is_finite(X_BT)) return;
  release(index);
  impl_->attach(tool, id.value - 1, X_BT);
  if (!tool.hand.has_handle()) tool.hand.anchor_at(impl_->tool_state(tool).X);
}

void World::move_grip(std::size_t index, const Pose& X_BT, double most_m) {
  constexpr double kTurnOfWay_rad_per_m = 10;
  WorldTool& tool = impl_->tools[index];
  if (!tool.held || !is_finite(X_BT)) return;
  const Vec3 turn = rotation_vector(X_BT.q * tool.X_BT.q.conjugate());
  tool.X_BT.p += clamped_to_length(X_BT.p - tool.X_BT.p, most_m);
  tool.X_BT.q = (quaternion_of(clamped_to_length(turn, most_m * kTurnOfWay_rad_per_m)) * tool.X_BT.q).normalized();
}

void World::release(std::size_t index) {
  WorldTool& tool = impl_->tools[index];
  if (!tool.held) return;
  impl_->detach(tool);
  if (!tool.hand.has_handle()) tool.hand.release();
}

void World::set_coupling(const haptics::CouplingLawInfo& law, const haptics::CouplingParameters& parameters) {
  SceneCoupling& coupling = impl_->coupling;
  const bool is_other_law = law.name != coupling.law;
  // This function is called in every tick. It returns early for unchanged values, because computing the coefficients of
  // each tool is expensive.
  if ((!is_other_law && parameters == coupling.parameters) || !haptics::is_usable(parameters)) return;
  if (is_other_law && !haptics::are_exchangeable(law, *haptics::find_coupling_law(coupling.law))) return;
  coupling.law = law.name;
  coupling.parameters = parameters;
  for (WorldTool& tool : impl_->tools) impl_->couple(tool);
}

void World::set_coupling(const haptics::CouplingParameters& parameters) {
  set_coupling(*haptics::find_coupling_law(impl_->coupling.law), parameters);
}

void World::set_coupling_bounds(std::size_t index, const haptics::CouplingParameters& bounds) {
  WorldTool& tool = impl_->tools[index];
  const auto is_bound = [&bounds](const haptics::CouplingRange& range) { return bounds.*range.value >= 0; };
  if (bounds == tool.coupling_bounds || !std::ranges::all_of(haptics::kCouplingRanges, is_bound)) return;
  tool.coupling_bounds = bounds;
  impl_->couple(tool);
}

const haptics::CouplingParameters& World::coupling(std::size_t tool) const {
  return impl_->tools[tool].hand.parameters();
}

}  // namespace tandem::physics

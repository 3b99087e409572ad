#include "client/model/partner_tools.hpp"

#include <algorithm>

namespace tandem::client {
namespace {

/// Time without a received state of a user after which this user counts as having left.
constexpr Duration kHoldKept = std::chrono::seconds(1);
/// Distance between received and local grip point above which the server must have moved the grip (Room::place()).
/// Smaller differences are due to the network delay while the body moves.
constexpr double kElsewhere_m = 0.005;

}  // namespace

void set_tool_state(physics::World& world, std::size_t tool, const physics::ToolState& state) noexcept {
  world.activate_tool(tool, false);
  if (state.held.is_valid()) {
    world.hold(tool, state.held, world.body(state.held).X.inverse() * state.tool.X);
  } else {
    world.set_tool(tool, state.tool);
  }
}

PartnerTools::PartnerTools() {
  partners_.reserve(proto::kMaxUsers);
}

bool PartnerTools::receive(const proto::ServerUpdate& update, physics::World& world) noexcept {
  for (const proto::OtherUserState& received : update.users) {
    auto known = std::find_if(partners_.begin(), partners_.end(),
                              [&received](const PartnerTool& one) { return one.partner.id() == received.id; });
    if (known == partners_.end()) {
      if (partners_.size() == partners_.capacity()) continue;
      partners_.push_back({Partner(received.id), 0, false, {}});
      known = partners_.end() - 1;
    }
    known->partner.receive(received, update);
  }
  const auto has_left = [&update](const PartnerTool& one) {
    return update.stepped - one.partner.received_at() > kHoldKept;
  };
  bool has_jumped = false;
  for (PartnerTool& one : partners_) {
    const Partner& partner = one.partner;
    if (one.is_active && (has_left(one) || !partner.has_handle() || partner.tool() != one.tool)) {
      has_jumped = deactivate(one, world) || has_jumped;
    }
    if (one.held.is_valid() && one.held != partner.holds()) {
      world.release(one.tool);
      one.held = BodyId{};
    }
  }
  std::erase_if(partners_, has_left);
  return has_jumped;
}

bool PartnerTools::drive(const ModelStep& step, std::span<const BodyCopy> bodies, bool predicts_motion,
                         std::size_t tools) noexcept {
  bool has_jumped = false;
  for (PartnerTool& one : partners_) {
    const bool is_tool = one.partner.tool() < tools && one.partner.tool() != step.tool;
    if (!one.partner.has_handle() || !is_tool) continue;
    PartnerSurroundings around = surroundings_of(one, step, bodies);
    around.is_predicted = predicts_motion;
    const double since_s = to_seconds(step.present - step.played);
    const RigidState handle = one.partner.predict(step.played, since_s, around, step.period_s);
    has_jumped = activate(one, step.world) || has_jumped;
    follow_grip(one, step, bodies);
    step.world.set_handle(one.tool, handle);
  }
  return has_jumped;
}

PartnerSurroundings PartnerTools::surroundings_of(const PartnerTool& one, const ModelStep& step,
                                                  std::span<const BodyCopy> bodies) noexcept {
  const physics::World& world = step.world;
  PartnerSurroundings around;
  if (!one.is_active) return around;
  around.on_hand_W = world.tool(one.tool).wrench_on_hand_W;
  for (const BodyCopy& body : bodies) {
    if (!body.is_known()) continue;
    const std::uint32_t hands = world.hands_on(body.id());
    const bool is_held = one.held == body.id();
    if ((hands >> one.tool & 1U) == 0 || (hands >> step.tool & 1U) == 0) continue;
    around.is_coupled = true;
    const Vec3 pressing_W = is_held ? Vec3(Vec3::Zero()) : world.pressing_normal_W(one.tool, body.id());
    // A body is common only if this user's tool holds or presses it. If this user's tool moves the body only through a
    // second body, the body does not follow this user's hand and is not common.
    const bool has_own_hand = step.held == body.id() || !world.pressing_normal_W(step.tool, body.id()).isZero();
    if (!has_own_hand || (!is_held && pressing_W.isZero())) continue;
    around.has_common_body = true;
    around.body = world.body(body.id());
    around.X_WB_then = body.pose_at(step.played);
    around.is_held = is_held;
    around.pressing_W = pressing_W;
    break;
  }
  return around;
}

/// Activates the partner's tool at the pose received from the server. Returns false if it is already active.
bool PartnerTools::activate(PartnerTool& one, physics::World& world) noexcept {
  if (one.is_active) return false;
  one.tool = one.partner.tool();
  // The argument false: the tool does not start with the grasp that the scene defines. The actual grasp is received
  // from the server.
  world.activate_tool(one.tool, false);
  world.set_tool(one.tool, one.partner.received_tool());
  one.is_active = true;
  return true;
}

bool PartnerTools::deactivate(PartnerTool& one, physics::World& world) noexcept {
  world.deactivate_tool(one.tool);
  const bool was_active = one.is_active;
  one.is_active = false;
  one.held = BodyId{};
  return was_active;
}

/// Makes the tool hold its body at the grip received from the server. If the server has moved the grip of a held body,
/// moves the grip in this world as well.
void PartnerTools::follow_grip(PartnerTool& one, const ModelStep& step, std::span<const BodyCopy> bodies) noexcept {
  const Partner& partner = one.partner;
  physics::World& world = step.world;
  if (one.held.is_valid() && one.held == partner.holds() && partner.place()) {
    const Pose X_BT = world.body(one.held).X.inverse() * world.tool(one.tool).tool.X;
    if ((X_BT.p - partner.place()->p).norm() > kElsewhere_m) {
      world.move_grip(one.tool, *partner.place(), step.grip_step_m);
    }
    return;
  }
  if (one.held.is_valid() || !partner.holds().is_valid() || !partner.place()) return;
  const auto is_it = [&partner](const BodyCopy& body) { return body.id() == partner.holds() && body.is_known(); };
  if (std::none_of(bodies.begin(), bodies.end(), is_it)) return;
  world.hold(one.tool, partner.holds(), *partner.place());
  one.held = partner.holds();
}

void PartnerTools::restart(physics::World& world) const noexcept {
  for (const PartnerTool& one : partners_) {
    if (one.is_active && !one.held.is_valid()) world.set_tool(one.tool, one.partner.received_tool());
  }
}

void PartnerTools::bound_couplings(physics::World& world, const HapticScene& scene) const noexcept {
  for (const PartnerTool& one : partners_) {
    if (one.is_active) world.set_coupling_bounds(one.tool, scene.coupling_bounds[one.tool]);
  }
}

void PartnerTools::bound_all_couplings(physics::World& world, const HapticScene& scene) const noexcept {
  for (const PartnerTool& one : partners_) world.set_coupling_bounds(one.tool, scene.coupling_bounds[one.tool]);
}

void PartnerTools::continue_in(physics::World& world, const physics::World& from) const noexcept {
  for (const PartnerTool& one : partners_) {
    if (one.is_active) set_tool_state(world, one.tool, from.tool(one.tool));
  }
}

bool PartnerTools::is_holding(BodyId body) const noexcept {
  return std::any_of(partners_.begin(), partners_.end(), [body](const PartnerTool& one) { return one.held == body; });
}

RigidState PartnerTools::tool_of(UserId user, const RigidState& received, const physics::World& world) const noexcept {
  const auto is_it = [user](const PartnerTool& one) { return one.is_active && one.partner.id() == user; };
  const auto found = std::find_if(partners_.begin(), partners_.end(), is_it);
  return found == partners_.end() ? received : world.tool(found->tool).tool;
}

double PartnerTools::common_share() const noexcept {
  double share = 0;
  bool is_alone = true;
  for (const PartnerTool& one : partners_) {
    if (!one.is_active) continue;
    is_alone = false;
    share = std::max(share, one.partner.common_share());
  }
  return is_alone ? 1 : share;
}

}  // namespace tandem::client

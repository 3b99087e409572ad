#include "server/room/room.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace tandem::server {
namespace {

bool has_several(std::uint32_t hands) {
  return std::popcount(hands) > 1;
}

/// A client that has not measured its loop yet is taken to have a long one, and is joined softly.
Duration loop_of(const proto::ClientUpdate& input) {
  constexpr Duration kUnknownLoop = std::chrono::milliseconds(200);
  return input.round_trip > Duration{0} ? input.round_trip : kUnknownLoop;
}

}  // namespace

Room::Room(RoomId id, std::string name, std::shared_ptr<const LoadedScene> scene, const RoomOptions& options)
    : id_(id),
      name_(std::move(name)),
      scene_(std::move(scene)),
      period_(from_seconds(1.0 / scene_->description.step_rate_hz())),
      controls_tool_passivity_(options.controls_tool_passivity &&
                               scene_->coupling.dynamics != haptics::ToolDynamics::kAtHandle),
      world_(make_server_world(scene_, options.soft_stepping)),
      coupling_(scene_->coupling.parameters) {
  for (auto& slot : slots_) slot = std::make_unique<UserSlot>();
  for (auto& bridge : bridges_) bridge = std::make_unique<Bridge>(to_seconds(period_));
  for (std::size_t i = 0; i < scene_->bodies.size(); ++i) {
    if (scene_->bodies[i].mass.mass_kg > 0) moving_bodies_.push_back(body_id_at(i));
  }
}

void Room::step(ServerTime now) noexcept {
  apply_commands();
  TickFaults faults = std::exchange(pending_faults_, 0);
  faults |= take_inputs();
  faults |= world_.step();
  ++step_.value;
  settle_waves();
  settle_tool_passivity();
  describe_world(now, faults);
  for (std::size_t slot = 0; slot < proto::kMaxUsers; ++slot) {
    if (members_[slot].user.is_valid()) publish_to(slot);
  }
}

void Room::apply_commands() noexcept {
  has_grabbed_.fill(false);
  RoomCommand command;
  for (int i = 0; i < kMaxCommandsPerStep && commands_.pop(command); ++i) apply(command);
}

void Room::apply(const RoomCommand& command) noexcept {
  if (command.slot >= proto::kMaxUsers) return;
  if (command.kind == RoomCommand::Kind::kJoin) return join(command);
  // A command that crossed its user's departure must not touch who has the slot now.
  const Member& member = members_[command.slot];
  if (!member.user.is_valid() || member.user != command.user) return;
  switch (command.kind) {
    case RoomCommand::Kind::kLeave:
      return leave(command.slot);
    case RoomCommand::Kind::kGrab:
    case RoomCommand::Kind::kRelease:
      return serve_request(command);
    case RoomCommand::Kind::kSetCoupling:
      coupling_ = command.coupling;
      return world_.set_coupling(command.coupling);
    case RoomCommand::Kind::kJoin:
      return;
  }
}

void Room::join(const RoomCommand& command) noexcept {
  leave(command.slot);
  if (command.role == UserRole::kManipulator && command.tool >= scene_->tools.size()) return;
  Member& member = members_[command.slot];
  member = Member{};
  member.user = command.user;
  member.role = command.role;
  member.tool = command.tool;
  member.leaves_gaps = command.leaves_gaps;
  // What the slot's former user sent last is not this one's.
  slots_[command.slot]->input.poll();
  bridges_[command.slot]->playout.reset();
  bridges_[command.slot]->wave.reset();
  bridges_[command.slot]->tool_passivity.reset();
  if (member.is_manipulator()) world_.activate_tool(member.tool);
}

void Room::leave(std::size_t slot) noexcept {
  Member& member = members_[slot];
  if (member.is_manipulator()) {
    let_tool_be(slot);
    world_.deactivate_tool(member.tool);
  }
  member = Member{};
}

// A grab measures the distance to every graspable body, so a slot has one a step.
void Room::serve_request(const RoomCommand& command) noexcept {
  Member& member = members_[command.slot];
  ++member.requests_served;
  if (!member.is_manipulator()) return;
  if (has_grabbed_[command.slot]) {
    emit({RoomEvent::Kind::kGrabRefused, command.slot, command.user, command.body, command.request,
          physics::GrabResult::kBusy});
  } else if (command.kind == RoomCommand::Kind::kGrab) {
    grab(command.slot, command.body, command.request);
  } else {
    release(command.slot, command.request);
  }
}

void Room::grab(std::size_t slot, BodyId body, std::uint32_t request) noexcept {
  const Member& member = members_[slot];
  has_grabbed_[slot] = true;
  RoomEvent event{RoomEvent::Kind::kGrabbed, static_cast<std::uint8_t>(slot), member.user, body, request, {}};
  event.refusal = world_.grab(member.tool, body);
  if (event.refusal == physics::GrabResult::kGrabbed) {
    event.body = world_.tool(member.tool).held;
  } else {
    event.kind = RoomEvent::Kind::kGrabRefused;
  }
  emit(event);
}

void Room::release(std::size_t slot, std::uint32_t request) noexcept {
  const Member& member = members_[slot];
  const BodyId held = world_.tool(member.tool).held;
  has_grabbed_[slot] = true;
  world_.release(member.tool);
  // An answer is due to a request even when nothing was held; the button asks for none.
  if (!held.is_valid() && request == 0) return;
  emit({RoomEvent::Kind::kReleased, static_cast<std::uint8_t>(slot), member.user, held, request, {}});
}

TickFaults Room::take_inputs() noexcept {
  TickFaults faults = 0;
  for (std::size_t slot = 0; slot < proto::kMaxUsers; ++slot) {
    if (members_[slot].is_manipulator()) faults |= take_input(slot);
  }
  return faults;
}

TickFaults Room::take_input(std::size_t slot) noexcept {
  Member& member = members_[slot];
  if (slots_[slot]->input.poll()) take_newest(slot);
  if (!member.has_input) return 0;
  TickFaults faults = 0;
  const bool is_stale = input_age(member) > kInputStaleAfter;
  if (is_stale || !member.newest.handle_valid) {
    // What waits to be played is dropped there: an opened hand must not be.
    if ((member.newest.buttons & kButtonGrab) == 0) follow_grab_button(slot, false);
    let_tool_be(slot);
  } else {
    faults |= limit_tool(slot);
    drive_tool(slot);
  }
  return is_stale ? faults | kFaultInputStale : faults;
}

void Room::take_newest(std::size_t slot) noexcept {
  Member& member = members_[slot];
  const proto::ClientMode before = member.newest.mode;
  const Tick tick_before = member.newest.input_tick;
  const double since_last_s = to_seconds(input_age(member));
  member.newest = slots_[slot]->input.front();
  member.input_seen_at = step_;
  member.has_left_a_gap = member.has_input && member.newest.input_tick.value > tick_before.value + 1;
  member.has_input = true;
  // What a local model's user presses is played out with the rest (play_out()): tool and body are then where he had
  // them. Let go in any case: a hand that is lost must be able to open.
  const bool is_down = (member.newest.buttons & kButtonGrab) != 0;
  const bool is_played = member.newest.mode == proto::ClientMode::kLocalModel;
  if (member.newest.handle_valid ? !is_played : !is_down) follow_grab_button(slot, is_down);
  if (member.newest.mode != before) let_tool_be(slot);
  if (!member.newest.handle_valid) return;
  Bridge& bridge = *bridges_[slot];
  if (is_played) {
    bridge.playout.take(member.newest, time_done());
  } else {
    bridge.tool_passivity.hand_reported(member.newest.energy_from_hand_j, member.newest.energy_to_hand_j, since_last_s);
  }
}

/// To the energy that its user's hand put in.
TickFaults Room::limit_tool(std::size_t slot) noexcept {
  if (!controls_tool_passivity_) return 0;
  const double share = bridges_[slot]->tool_passivity.gain(to_seconds(period_));
  world_.limit_pull(members_[slot].tool, share);
  return share < 1 ? TickFaults{kFaultToolEnergyLimited} : 0;
}

void Room::drive_tool(std::size_t slot) noexcept {
  Member& member = members_[slot];
  switch (member.newest.mode) {
    case proto::ClientMode::kLocalModel:
      return play_out(slot);
    case proto::ClientMode::kWave:
      return move_by_wave(slot);
    case proto::ClientMode::kHandle:
      break;
  }
  member.answered = member.newest.input_tick;
  RigidState handle = member.newest.handle;
  if (member.leaves_gaps || member.has_left_a_gap) {
    handle.X = integrate(handle.X, handle.V, to_seconds(std::min(input_age(member), kExtrapolatedFor)));
  }
  pull_to(slot, handle);
}

void Room::pull_to(std::size_t slot, const RigidState& handle) noexcept {
  Member& member = members_[slot];
  world_.set_handle(member.tool, handle);
  if (std::exchange(member.is_driven, true)) return;
  bridges_[slot]->tool_passivity.restart_handle(world_.energy_of_tool_j(member.tool));
}

/// Until there is an input again: nothing that is on its way is played any more.
void Room::let_tool_be(std::size_t slot) noexcept {
  Member& member = members_[slot];
  member.answered = member.newest.input_tick;
  member.is_driven = false;
  member.joint_share.reset();
  member.shared_until = Step{};
  member.slowest_loop = Duration{0};
  bridges_[slot]->playout.reset();
  bridges_[slot]->wave.reset();
  world_.limit_pull(member.tool, 1);
  world_.join_copies(member.tool, RigidState{}, {}, {}, 0);
  world_.clear_handle(member.tool);
}

void Room::play_out(std::size_t slot) noexcept {
  Member& member = members_[slot];
  InputPlayout& playout = bridges_[slot]->playout;
  const auto played = playout.play(time_done());
  if (!played) return;
  member.answered = played->tick;
  bridges_[slot]->tool_passivity.hand_reported(played->energy_from_hand_j, played->energy_to_hand_j,
                                               to_seconds(period_));
  pull_to(slot, played->handle);
  join_copies(slot, *played);
  follow_grab_button(slot, (played->buttons & kButtonGrab) != 0);
}

void Room::join_copies(std::size_t slot, const PlayedInput& played) noexcept {
  Member& member = members_[slot];
  member.slowest_loop = slowest_loop(slot);
  if (member.slowest_loop > Duration{0}) {
    member.shared_until = Step{step_.value + static_cast<std::uint64_t>(kSharedFor / period_)};
  }
  const double share = member.joint_share.step(to_seconds(period_), step_ < member.shared_until);
  const BodyId held = world_.tool(member.tool).held;
  const double weight = weight_on_copy(member, held);
  boost::container::static_vector<physics::Joint, kMaxCopies> joints;
  boost::container::static_vector<double, kMaxCopies> weights;
  for (const CopyTarget& copy : played.copies) {
    weights.push_back(copy.body == held ? weight : 0);
    const Vec3 pressing_W = world_.body(copy.body).X.q * copy.pressing_B;
    joints.push_back(physics::joint_for(loop_of(member.newest), member.slowest_loop, pressing_W));
  }
  world_.join_copies(member.tool, played.tool, played.copies, joints, share, weights);
}

/// What one user holds and others touch hangs in his hand, as it would without a network: his copy bears the weight, so
/// that the joints, which are soft, have none to bear. His client does the same when it is told that nobody else holds
/// it, and what it does then is here a loop after. What several hold bears its weight here, and hangs in all their
/// joints alike.
double Room::weight_on_copy(Member& member, BodyId held) const noexcept {
  const double wanted = held.is_valid() && holders_of(held) == 1 ? 1.0 : 0.0;
  if (!held.is_valid()) member.weight.reset();
  if (wanted != member.weight_wanted) member.weight_wanted_since = step_;
  member.weight_wanted = wanted;
  const Duration known_for = period_ * static_cast<Duration::rep>(step_.value - member.weight_wanted_since.value);
  return known_for < loop_of(member.newest) ? member.weight.now() : member.weight.step(to_seconds(period_), wanted);
}

std::size_t Room::holders_of(BodyId body) const noexcept {
  const auto holds = [&](const Member& member) {
    return member.is_manipulator() && world_.tool(member.tool).held == body;
  };
  return static_cast<std::size_t>(std::count_if(members_.begin(), members_.end(), holds));
}

/// The waves move a handle of their own; where the hand is, only keeps it from drifting away.
void Room::move_by_wave(std::size_t slot) noexcept {
  Member& member = members_[slot];
  const BodyId held = world_.tool(member.tool).held;
  const auto body = held.is_valid() ? std::optional<std::size_t>(held.value - 1) : std::nullopt;
  const haptics::CouplingParameters in_force =
      physics::coupling_in_force(scene_->coupling, coupling_, moved_mass(*scene_, member.tool, body));
  member.answered = member.newest.input_tick;
  pull_to(slot, bridges_[slot]->wave.target(member.newest, in_force, to_seconds(period_)));
}

void Room::settle_waves() noexcept {
  for (std::size_t slot = 0; slot < proto::kMaxUsers; ++slot) {
    const Member& member = members_[slot];
    if (!member.is_in(proto::ClientMode::kWave) || !member.newest.handle_valid) continue;
    bridges_[slot]->wave.settle(world_.tool(member.tool).wrench_on_hand_W, to_seconds(period_));
  }
}

void Room::settle_tool_passivity() noexcept {
  if (!controls_tool_passivity_) return;
  for (std::size_t slot = 0; slot < proto::kMaxUsers; ++slot) {
    const Member& member = members_[slot];
    if (!member.is_manipulator()) continue;
    const physics::ToolState tool = world_.tool(member.tool);
    const double net_into_world_j = tool.energy_into_world_j + tool.weight_work_j - tool.energy_from_world_j;
    bridges_[slot]->tool_passivity.stepped(tool.tool.X, tool.pull_on_tool_W, net_into_world_j);
  }
}

/// Another user has a hand on it too.
bool Room::is_shared(BodyId body, std::size_t tool) const noexcept {
  const std::uint32_t hands = hands_[body.value - 1];
  return (hands >> tool & 1U) != 0 && has_several(hands);
}

/// The longest loop of all whose copies are joined to a body that this user's tool holds or touches together with
/// another user, this one among them; 0: nobody else has a hand on it.
Duration Room::slowest_loop(std::size_t slot) const noexcept {
  const std::size_t tool = members_[slot].tool;
  std::uint32_t hands = 0;
  for (const BodyId body : moving_bodies_) {
    if (is_shared(body, tool)) hands |= hands_[body.value - 1];
  }
  Duration slowest{0};
  for (const Member& member : members_) {
    if (!member.is_in(proto::ClientMode::kLocalModel) || (hands >> member.tool & 1U) == 0) continue;
    slowest = std::max(slowest, loop_of(member.newest));
  }
  return slowest;
}

void Room::follow_grab_button(std::size_t slot, bool is_down) noexcept {
  Member& member = members_[slot];
  // After a command of this step the button has its turn with the next input.
  if (is_down == member.grab_button || has_grabbed_[slot]) return;
  member.grab_button = is_down;
  if (is_down) {
    grab(slot, BodyId{}, 0);
  } else {
    release(slot, 0);
  }
}

void Room::describe_world(ServerTime now, TickFaults faults) noexcept {
  common_.step = step_;
  common_.stepped = now;
  common_.tick_faults = faults;
  common_.field_energy_kj_per_mol = world_.field_energy_kj_per_mol();
  common_.bodies.clear();
  for (const BodyId id : moving_bodies_) {
    hands_[id.value - 1] = world_.hands_on(id);
    const auto hands = static_cast<std::uint32_t>(std::popcount(hands_[id.value - 1]));
    common_.bodies.push_back({id, world_.body(id), UserId{}, hands});
  }
  for (const Member& member : members_) {
    if (!member.is_manipulator()) continue;
    const BodyId held = world_.tool(member.tool).held;
    const auto body = std::find_if(common_.bodies.begin(), common_.bodies.end(),
                                   [held](const proto::BodyState& candidate) { return candidate.id == held; });
    // Of several who hold a body, the one in the lowest slot is named.
    if (body != common_.bodies.end() && !body->held_by.is_valid()) body->held_by = member.user;
  }
}

void Room::publish_to(std::size_t slot) noexcept {
  const Member& member = members_[slot];
  UserUpdate& told = slots_[slot]->output.back();
  told.user = member.user;
  told.requests_served = member.requests_served;
  proto::ServerUpdate& update = told.update;
  update = common_;
  update.answered_input = member.answered;
  update.echoed_sent = member.newest.sent;
  if (member.is_manipulator()) describe_tool(slot, update);
  for (std::size_t other = 0; other < proto::kMaxUsers; ++other) {
    if (other == slot || !members_[other].is_manipulator()) continue;
    const physics::ToolState tool = world_.tool(members_[other].tool);
    update.users.push_back({members_[other].user, tool.tool, tool.held});
  }
  slots_[slot]->output.publish();
}

void Room::describe_tool(std::size_t slot, proto::ServerUpdate& update) const noexcept {
  const Member& member = members_[slot];
  const physics::ToolState tool = world_.tool(member.tool);
  update.tool = tool.tool;
  update.wrench_on_hand_W = tool.wrench_on_hand_W;
  update.held_body = tool.held;
  if (tool.held.is_valid()) update.X_BT = world_.body(tool.held).X.inverse() * tool.tool.X;
  update.energy_into_world_j = tool.energy_into_world_j;
  update.energy_from_world_j = tool.energy_from_world_j;
  update.soft_contact = world_.soft_contact(member.tool);
  const Bridge& bridge = *bridges_[slot];
  if (member.is_in(proto::ClientMode::kLocalModel)) {
    update.joint_share = member.joint_share.now();
    update.playout = bridge.playout.delay();
    update.slowest_loop = member.slowest_loop;
  }
  if (member.is_in(proto::ClientMode::kWave)) update.wave = bridge.wave.wave();
}

Tick Room::answered(std::size_t tool) const {
  const auto moves = [tool](const Member& member) { return member.is_manipulator() && member.tool == tool; };
  const auto member = std::find_if(members_.begin(), members_.end(), moves);
  return member == members_.end() ? Tick{} : member->answered;
}

void Room::emit(const RoomEvent& event) noexcept {
  if (!events_.push(event)) ++events_lost_;
}

}  // namespace tandem::server

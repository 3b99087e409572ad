#include "server/room.hpp"

#include <algorithm>
#include <utility>

namespace tandem {

Room::Room(RoomId id, std::string name, std::shared_ptr<const LoadedScene> scene, World::SoftStepping soft_stepping)
    : id_(id),
      name_(std::move(name)),
      scene_(std::move(scene)),
      period_(from_seconds(1.0 / scene_->description.step_rate_hz())),
      world_(scene_, soft_stepping) {
  for (auto& slot : slots_) slot = std::make_unique<UserSlot>();
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
  describe_world(now, faults);
  for (std::size_t slot = 0; slot < kMaxUsers; ++slot) {
    if (members_[slot].user.is_valid()) publish_to(slot);
  }
}

void Room::apply_commands() noexcept {
  has_grabbed_.fill(false);
  RoomCommand command;
  for (int i = 0; i < kMaxCommandsPerStep && commands_.pop(command); ++i) apply(command);
}

void Room::apply(const RoomCommand& command) noexcept {
  if (command.slot >= kMaxUsers) return;
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
  // What the slot's former user sent last is not this one's.
  slots_[command.slot]->input.poll();
  if (member.is_manipulator()) world_.activate_tool(member.tool);
}

void Room::leave(std::size_t slot) noexcept {
  Member& member = members_[slot];
  if (member.is_manipulator()) world_.deactivate_tool(member.tool);
  member = Member{};
}

// A grab measures the distance to every graspable body, so a slot has one a step.
void Room::serve_request(const RoomCommand& command) noexcept {
  Member& member = members_[command.slot];
  ++member.requests_served;
  if (!member.is_manipulator()) return;
  if (has_grabbed_[command.slot]) {
    emit({RoomEvent::Kind::kGrabRefused, command.slot, command.user, command.body, command.request, GrabResult::kBusy});
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
  if (event.refusal == GrabResult::kGrabbed) {
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
  for (std::size_t slot = 0; slot < kMaxUsers; ++slot) {
    if (members_[slot].is_manipulator()) faults |= take_input(slot);
  }
  return faults;
}

TickFaults Room::take_input(std::size_t slot) noexcept {
  Member& member = members_[slot];
  if (slots_[slot]->input.poll()) {
    member.newest = slots_[slot]->input.front();
    member.input_seen_at = step_;
    member.has_input = true;
    // Let go in any case: a hand that is lost must be able to open.
    const bool is_down = (member.newest.buttons & kButtonGrab) != 0;
    if (member.newest.handle_valid || !is_down) follow_grab_button(slot, is_down);
  }
  if (!member.has_input) return 0;
  const Duration age = period_ * static_cast<Duration::rep>(step_.value - member.input_seen_at.value);
  const bool is_stale = age > kInputStaleAfter;
  if (is_stale || !member.newest.handle_valid) {
    world_.clear_handle(member.tool);
  } else {
    world_.set_handle(member.tool, member.newest.handle);
  }
  return is_stale ? TickFaults{kFaultInputStale} : 0;
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
  for (const BodyId id : moving_bodies_) common_.bodies.push_back({id, world_.body(id), UserId{}});
  for (const Member& member : members_) {
    if (!member.is_manipulator()) continue;
    const BodyId held = world_.tool(member.tool).held;
    const auto body = std::find_if(common_.bodies.begin(), common_.bodies.end(),
                                   [held](const BodyState& candidate) { return candidate.id == held; });
    // Of several who hold a body, the one in the lowest slot is named.
    if (body != common_.bodies.end() && !body->held_by.is_valid()) body->held_by = member.user;
  }
}

void Room::publish_to(std::size_t slot) noexcept {
  const Member& member = members_[slot];
  UserUpdate& told = slots_[slot]->output.back();
  told.user = member.user;
  told.requests_served = member.requests_served;
  ServerUpdate& update = told.update;
  update = common_;
  update.answered_input = member.newest.input_tick;
  update.echoed_sent = member.newest.sent;
  if (member.is_manipulator()) {
    const ToolState tool = world_.tool(member.tool);
    update.tool = tool.tool;
    update.wrench_on_hand_W = tool.wrench_on_hand_W;
    update.held_body = tool.held;
    update.energy_into_world_j = tool.energy_into_world_j;
    update.energy_from_world_j = tool.energy_from_world_j;
  }
  for (std::size_t other = 0; other < kMaxUsers; ++other) {
    if (other == slot || !members_[other].is_manipulator()) continue;
    const ToolState tool = world_.tool(members_[other].tool);
    update.users.push_back({members_[other].user, tool.tool, tool.held});
  }
  slots_[slot]->output.publish();
}

void Room::emit(const RoomEvent& event) noexcept {
  if (!events_.push(event)) ++events_lost_;
}

}  // namespace tandem

#include "server/room/room.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/room/tool_driver.hpp"

namespace tandem::server {
namespace {

/// Rate at which the offsets of soft bodies are sent to clients for display.
constexpr double kSoftOffsets_hz = 20;

}  // namespace

proto::ServerUpdate RoomUpdate::for_seat(std::size_t seat) const {
  proto::ServerUpdate update;
  static_cast<proto::OwnUpdate&>(update) = own[seat];
  update.bodies = bodies;
  std::ranges::copy_if(users, std::back_inserter(update.users),
                       [this, seat](const proto::OtherUserState& other) { return other.id != user[seat]; });
  return update;
}

/// State of a seat for the room's loop. It is large, so it is allocated once and reused for the next user of the seat.
struct Room::User {
  explicit User(Room& room, bool is_limited)
      : port(room.world_, is_limited), drivers(make_tool_drivers(room.period_, port)), driver(drivers.front().get()) {}

  ToolDriver& driver_for(proto::ClientMode mode) const {
    return *drivers[std::min(static_cast<std::size_t>(mode), drivers.size() - 1)];
  }
  /// Stops driving the tool until the next input arrives.
  void release_tool() noexcept {
    input.answered = input.newest.input_tick;
    driver->stop();
    port.clear_handle();
  }

  realtime::Mailbox<proto::ClientUpdate> inbox;
  Seat seat;
  UserInput input;
  ToolPort port;
  ToolDrivers drivers;
  ToolDriver* driver;  ///< driver for the mode of the newest input; one of `drivers`
  bool grab_button = false;
  bool has_grabbed = false;  ///< a grab or a release was done in this step, possibly by the seat's previous user
  std::uint64_t requests_served = 0;
};

Room::Room(RoomId id, std::string name, std::shared_ptr<const LoadedScene> scene, const RoomOptions& options)
    : id_(id),
      name_(std::move(name)),
      scene_(std::move(scene)),
      options_(options),
      period_(from_seconds(1.0 / scene_->description.step_rate_hz())),
      start_settings_(options.start),
      moving_bodies_(moving_bodies_of(*scene_)),
      world_(make_server_world(scene_, options.steps_soft_aside)),
      soft_lattices_(scene_->soft_bodies),
      soft_offsets_(soft_lattices_.at_rest()) {
  const bool is_limited =
      options.controls_tool_passivity && scene_->world.coupling.dynamics != haptics::ToolDynamics::kAtHandle;
  for (auto& user : users_) user = std::make_unique<User>(*this, is_limited);
  if (auto plan = make_game_plan(*scene_)) {
    game_.emplace(*scene_, std::move(*plan));
    game_->restart(world_, 0);
  }
}

Room::~Room() = default;

realtime::Mailbox<proto::ClientUpdate>& Room::input(std::size_t seat) {
  return users_[seat]->inbox;
}

const Seat& Room::seat(std::size_t index) const {
  return users_[index]->seat;
}

const haptics::ToolPassivityController& Room::tool_passivity(std::size_t seat) const {
  return users_[seat]->port.passivity();
}

double Room::braked_j() const noexcept {
  double sum_j = 0;
  for (const auto& user : users_) sum_j += user->port.braked_j();
  return sum_j;
}

bool Room::is_empty() const noexcept {
  return std::ranges::none_of(users_, [](const auto& user) { return user->seat.user.is_valid(); });
}

bool Room::is_idle() const {
  const bool stays_as_it_is = is_as_at_start_ || scene_->world.limits.reset_after_s == 0;
  return commands_.is_empty() && stays_as_it_is && is_empty();
}

/// Resets the scene after the room has been empty for reset_after_s, so that the next user finds it at its start.
void Room::start_anew_when_left() noexcept {
  steps_empty_ = is_empty() ? steps_empty_ + 1 : 0;
  is_as_at_start_ = is_as_at_start_ && steps_empty_ > 0;
  const double after_s = scene_->world.limits.reset_after_s;
  if (is_as_at_start_ || after_s == 0 || static_cast<double>(steps_empty_) * to_seconds(period_) < after_s) return;
  world_ = make_server_world(scene_, options_.steps_soft_aside);
  if (game_) game_->restart(world_, 0);
  left_.fill(std::nullopt);
  is_as_at_start_ = true;
}

void Room::step(ServerTime now) noexcept {
  answer(now);
  finish();
}

void Room::answer(ServerTime now) noexcept {
  finish();
  // In an empty room nobody receives the faults of the last step, so they are discarded.
  if (is_empty()) late_faults_ = 0;
  if (game_) game_->begin_step(Step{step_.value + 1});
  apply_commands();
  // The age of signals is counted in steps. An empty room may stop its steps, so the signals are discarded.
  if (game_ && is_empty()) game_->forget_signals();
  start_anew_when_left();
  TickFaults faults = std::exchange(pending_faults_, 0);
  faults |= receive_inputs();
  keep_left_things();
  faults |= world_.answer();
  ++step_.value;
  settle_tools();
  describe_world(now, faults | late_faults_);
  output_.publish();
  answered_.emplace(now, faults);
}

void Room::finish() noexcept {
  const auto answered = std::exchange(answered_, std::nullopt);
  if (!answered) return;
  late_faults_ = world_.finish();
  if (game_) game_->step(world_, hands());
  for (const BodyId body : world_.returned_bodies()) emit({RoomEvent::Kind::kReturned, UserId{}, body, 0, {}});
  publish_soft_offsets();
  for (RoomWatcher* const watcher : watchers_)
    watcher->on_step(*this, answered->first, answered->second | late_faults_);
  world_.look_ahead();
}

void Room::publish_soft_offsets() noexcept {
  const auto every = static_cast<std::uint64_t>(std::max(1.0, 1 / (kSoftOffsets_hz * to_seconds(period_))));
  if (scene_->soft_bodies.empty() || step_.value % every != 0) return;
  soft_lattices_.measure(world_, soft_offsets_.back());
  soft_offsets_.publish();
}

/// Moves all bodies back to their start. Emits a kReleased event for each user whose held body is released by the move.
void Room::reset() noexcept {
  std::array<BodyId, proto::kMaxUsers> held{};
  const auto held_by = [this](const User& user) { return world_.tool(user.seat.tool).held; };
  for (const auto& user : users_) {
    if (user->seat.is_manipulator()) held[user->seat.index] = held_by(*user);
  }
  world_.return_all();
  for (const auto& user : users_) {
    const BodyId before = held[user->seat.index];
    if (!user->seat.is_manipulator() || !before.is_valid() || held_by(*user) == before) continue;
    emit({RoomEvent::Kind::kReleased, user->seat.user, before, 0, {}});
  }
  if (game_) game_->restart(world_, hands());
}

/// Returns the tools that have a user, as a bit mask.
std::uint32_t Room::hands() const noexcept {
  std::uint32_t tools = 0;
  for (const auto& user : users_) {
    if (user->seat.is_manipulator()) tools |= std::uint32_t{1} << user->seat.tool;
  }
  return tools;
}

bool Room::moves(BodyId body) const noexcept {
  return std::ranges::find(moving_bodies_, body) != moving_bodies_.end();
}

/// Sets the pose of a body of the scene. A tool that holds the body keeps its pose and gets a new grip, so that its
/// coupling force does not jump.
void Room::place(BodyId body, const Pose& X_WB) noexcept {
  if (!moves(body) || world_.is_absent(body) || !is_finite(X_WB) || X_WB.p.norm() > proto::kMaxPositionM) return;
  constexpr double kWholeWay_m = 1e6;
  Twist velocity;
  for (const auto& user : users_) {
    if (!user->seat.is_manipulator()) continue;
    const physics::ToolState held = world_.tool(user->seat.tool);
    if (held.held != body) continue;
    world_.move_grip(user->seat.tool, X_WB.inverse() * held.tool.X, kWholeWay_m);
    velocity = {held.tool.V.v + held.tool.V.w.cross(X_WB.p - held.tool.X.p), held.tool.V.w};
  }
  world_.set_body(body, {X_WB, velocity});
}

void Room::apply_commands() noexcept {
  for (const auto& user : users_) user->has_grabbed = false;
  RoomCommand command;
  for (int i = 0; i < kMaxCommandsPerStep && commands_.pop(command); ++i) {
    if (is_outdated(command)) continue;
    for (RoomWatcher* const watcher : watchers_) watcher->on_command(command);
    apply(command);
  }
  for (RoomWatcher* const watcher : watchers_) watcher->on_commands_done();
}

/// Returns whether a command sets a coupling that was chosen for an earlier level of the game.
bool Room::is_outdated(const RoomCommand& command) const noexcept {
  return command.kind == RoomCommand::Kind::kSetCoupling && command.entries != 0 && game_ &&
         command.entries != game_->status().entries;
}

void Room::apply(const RoomCommand& command) noexcept {
  if (command.seat.index >= proto::kMaxUsers) return;
  if (command.kind == RoomCommand::Kind::kSetSignal) {
    return game_ && !is_empty() ? game_->set_signal(command.signal, command.signal_value) : void();
  }
  if (command.kind == RoomCommand::Kind::kJoin) return join(command.seat);
  User& user = *users_[command.seat.index];
  // A command can be applied after its user has left. It must not affect the next user of the seat.
  if (!user.seat.user.is_valid() || user.seat.user != command.seat.user) return;
  switch (command.kind) {
    case RoomCommand::Kind::kLeave:
      return leave(user);
    case RoomCommand::Kind::kGrab:
    case RoomCommand::Kind::kRelease:
      return serve_request(user, command);
    case RoomCommand::Kind::kSetCoupling:
      return command.law == nullptr ? world_.set_coupling(command.coupling)
                                    : world_.set_coupling(*command.law, command.coupling);
    case RoomCommand::Kind::kReset:
      return reset();
    case RoomCommand::Kind::kPlace:
      return place(command.body, world_.body(command.beside).X * command.X_SB);
    case RoomCommand::Kind::kStartLevel:
      return game_ ? game_->start_level(command.level, world_, hands()) : void();
    case RoomCommand::Kind::kSetWeight:
      return game_ ? game_->set_weightless(command.is_weightless, world_) : void();
    case RoomCommand::Kind::kSetSignal:
    case RoomCommand::Kind::kJoin:
      return;
  }
}

void Room::join(const Seat& seat) noexcept {
  User& user = *users_[seat.index];
  leave(user);
  if (has_tool(seat.role) && seat.tool >= scene_->world.tools.size()) return;
  user.seat = seat;
  // Discards the last input of the seat's previous user from the mailbox.
  user.inbox.poll();
  if (seat.is_manipulator()) open_port(user);
}

/// Activates a user's tool. If resume() has saved a state for this tool, that state and its held body replace the
/// scene's.
void Room::open_port(User& user) noexcept {
  const std::size_t tool = user.seat.tool;
  const auto left = std::exchange(left_[tool], std::nullopt);
  const auto holds = scene_->world.tools[tool].holds_body;
  const BodyId by_scene = holds ? body_id_at(*holds) : BodyId{};
  const RigidState before = world_.body(by_scene);
  user.port.open(tool, user.seat.coupling_bounds);
  if (!left) return;
  if (by_scene.is_valid()) {
    world_.release(tool);
    world_.set_body(by_scene, before);
  }
  if (left->held.is_valid() && !world_.is_absent(left->held)) {
    world_.hold(tool, left->held, left->X_BT);
    user.grab_button = true;
  } else {
    world_.set_tool(tool, left->state);
  }
}

/// Keeps the bodies that reserved tools hold at their saved poses, until kKeptFor has passed.
void Room::keep_left_things() noexcept {
  for (auto& left : left_) {
    if (!left) continue;
    if (time_done() > kKeptFor) {
      left.reset();
    } else if (left->held.is_valid() && !world_.is_absent(left->held)) {
      world_.set_body(left->held, {left->state.X * left->X_BT.inverse(), Twist{}});
    }
  }
}

void Room::resume(const RoomState& state) {
  const auto is_in_range = [](const RigidState& of) {
    return is_finite(of) && of.X.p.norm() <= proto::kMaxPositionM && of.V.v.norm() <= proto::kMaxSpeedMPerS &&
           of.V.w.norm() <= proto::kMaxTurnRadPerS;
  };
  for (const proto::BodyState& body : state.bodies) {
    if (!moves(body.id) || !is_in_range(body.state)) continue;
    world_.set_body(body.id, body.state);
    is_as_at_start_ = false;
  }
  for (const RoomState::Tool& tool : state.tools) {
    const bool holds = moves(tool.held);
    if (tool.tool >= scene_->world.tools.size() || !is_in_range(tool.state) || !is_finite(tool.X_BT)) continue;
    left_[tool.tool] = tool;
    if (!holds) left_[tool.tool]->held = BodyId{};
    is_as_at_start_ = false;
  }
  resume_soft_bodies(state.soft_nodes_W);
  if (game_ && state.game && game_->resume(*state.game, world_)) is_as_at_start_ = false;
}

void Room::resume_soft_bodies(std::span<const Vec3> nodes_W) {
  std::size_t count = 0;
  for (const SoftModel& body : scene_->soft_bodies) count += body.nodes_W.size();
  const auto is_in_range = [](const Vec3& p) { return p.allFinite() && p.norm() <= proto::kMaxPositionM; };
  if (nodes_W.empty() || nodes_W.size() != count || !std::ranges::all_of(nodes_W, is_in_range)) return;
  for (std::size_t i = 0; i < scene_->soft_bodies.size(); ++i) {
    const std::size_t nodes = scene_->soft_bodies[i].nodes_W.size();
    world_.set_soft_nodes(i, nodes_W.first(nodes));
    nodes_W = nodes_W.subspan(nodes);
  }
  is_as_at_start_ = false;
}

void Room::describe(RoomState& state) const noexcept {
  state.bodies.clear();
  state.tools.clear();
  state.game.reset();
  if (game_) state.game = game_->status();
  describe_soft_bodies(state.soft_nodes_W);
  for (const BodyId id : moving_bodies_) {
    const RigidState now = world_.body(id);
    const Pose& start = scene_->world.bodies[id.value - 1].X_WB;
    const bool is_at_start = now.X.p == start.p && now.V.v.isZero(0) && now.V.w.isZero(0);
    if (!is_at_start) state.bodies.push_back({id, now, UserId{}});
  }
  for (const auto& user : users_) {
    if (!user->seat.is_manipulator()) continue;
    const physics::ToolState tool = world_.tool(user->seat.tool);
    Pose X_BT;
    if (tool.held.is_valid()) X_BT = world_.body(tool.held).X.inverse() * tool.tool.X;
    state.tools.push_back({user->seat.tool, tool.tool, tool.held, X_BT});
  }
  for (const auto& left : left_) {
    const bool is_listed =
        left && std::ranges::any_of(state.tools, [&](const auto& t) { return t.tool == left->tool; });
    if (left && !is_listed) state.tools.push_back(*left);
  }
}

void Room::describe_soft_bodies(std::vector<Vec3>& nodes_W) const noexcept {
  nodes_W.clear();
  bool is_at_start = true;
  for (std::size_t i = 0; i < scene_->soft_bodies.size(); ++i) {
    const std::span<const Vec3> now_W = world_.soft_nodes_W(i);
    is_at_start = is_at_start && std::ranges::equal(now_W, scene_->soft_bodies[i].nodes_W);
    nodes_W.insert(nodes_W.end(), now_W.begin(), now_W.end());
  }
  if (is_at_start) nodes_W.clear();
}

void Room::leave(User& user) noexcept {
  if (user.seat.is_manipulator()) {
    user.driver->reset();
    user.port.close();
  }
  user.driver = &user.driver_for(proto::ClientMode::kHandle);
  user.seat = Seat{};
  user.input = UserInput{};
  user.grab_button = false;
  user.requests_served = 0;
}

// Serves a request to grab or release. At most one request per seat is served in a step, because a grab measures the
// distance to every graspable body.
void Room::serve_request(User& user, const RoomCommand& command) noexcept {
  ++user.requests_served;
  if (!user.seat.is_manipulator()) return;
  if (user.has_grabbed) {
    emit({RoomEvent::Kind::kGrabRefused, user.seat.user, command.body, command.request, physics::GrabResult::kBusy});
  } else if (command.kind == RoomCommand::Kind::kGrab) {
    grab(user, command.body, command.request);
  } else {
    release(user, command.request);
  }
}

void Room::grab(User& user, BodyId body, std::uint32_t request) noexcept {
  user.has_grabbed = true;
  RoomEvent event{RoomEvent::Kind::kGrabbed, user.seat.user, body, request, {}};
  event.refusal = world_.grab(user.seat.tool, body);
  if (event.refusal == physics::GrabResult::kGrabbed) {
    event.body = world_.tool(user.seat.tool).held;
  } else {
    event.kind = RoomEvent::Kind::kGrabRefused;
  }
  emit(event);
}

void Room::release(User& user, std::uint32_t request) noexcept {
  const BodyId held = world_.tool(user.seat.tool).held;
  user.has_grabbed = true;
  world_.release(user.seat.tool);
  // A request (number > 0) must be answered even if the tool held nothing. A release by button (number 0) needs no
  // answer.
  if (!held.is_valid() && request == 0) return;
  emit({RoomEvent::Kind::kReleased, user.seat.user, held, request, {}});
}

TickFaults Room::receive_inputs() noexcept {
  TickFaults faults = 0;
  for (const auto& user : users_) {
    if (user->seat.is_manipulator()) faults |= receive_input(*user);
  }
  return faults;
}

TickFaults Room::receive_input(User& user) noexcept {
  if (user.inbox.poll()) {
    for (RoomWatcher* const watcher : watchers_) watcher->on_input(user.seat.index, user.inbox.front());
    receive_newest(user);
  }
  const UserInput& input = user.input;
  if (!input.has_arrived) return 0;
  const bool is_stale = time_done() - input.arrived > kInputStaleAfter;
  if (is_stale || !input.has_handle()) {
    // A driver with a delay applies the buttons of an input when it plays that input. Without a handle it plays no
    // input. A release of the grab button is therefore applied here, at once.
    if ((input.newest.buttons & kButtonGrab) == 0) follow_grab_button(user, 0);
    user.release_tool();
    return is_stale ? TickFaults{kFaultInputStale} : 0;
  }
  const TickFaults faults = user.port.limit(to_seconds(period_));
  const auto buttons = user.driver->drive(user.input, time_done());
  if (buttons) follow_grab_button(user, *buttons);
  return faults;
}

void Room::receive_newest(User& user) noexcept {
  UserInput& input = user.input;
  const Tick tick_before = input.newest.input_tick;
  input.newest = user.inbox.front();
  input.since_last = time_done() - std::exchange(input.arrived, time_done());
  const bool has_left_a_gap = input.has_arrived && input.newest.input_tick.value > tick_before.value + 1;
  input.has_gaps = user.seat.leaves_gaps || has_left_a_gap;
  input.has_arrived = true;
  ToolDriver& driver = user.driver_for(input.newest.mode);
  // A driver with a delay applies the buttons of an input when it plays that input. It does not play an input without a
  // valid handle. Such an input can only release the grab button, and the release is applied at once.
  const bool is_down = (input.newest.buttons & kButtonGrab) != 0;
  if (input.newest.handle_valid ? !driver.delays_buttons() : !is_down) follow_grab_button(user, input.newest.buttons);
  if (&driver != user.driver) {
    user.driver->reset();
    user.driver = &driver;
    user.release_tool();
  }
  driver.receive(input, time_done());
}

void Room::follow_grab_button(User& user, std::uint32_t buttons) noexcept {
  const bool is_down = (buttons & kButtonGrab) != 0;
  // After a command has grabbed or released in this step, the button is evaluated with the next input.
  if (is_down == user.grab_button || user.has_grabbed) return;
  user.grab_button = is_down;
  if (is_down) {
    grab(user, BodyId{}, 0);
  } else {
    release(user, 0);
  }
}

void Room::settle_tools() noexcept {
  for (const auto& user : users_) {
    if (!user->seat.is_manipulator()) continue;
    if (user->input.has_handle()) user->driver->settle();
    user->port.settle();
  }
}

void Room::describe_world(ServerTime now, TickFaults faults) noexcept {
  RoomUpdate& update = output_.back();
  update.bodies.clear();
  for (const BodyId id : moving_bodies_) {
    if (!world_.is_absent(id)) update.bodies.push_back({id, world_.body(id), UserId{}});
  }
  update.users.clear();
  for (const auto& user : users_) {
    if (!user->seat.is_manipulator()) continue;
    const physics::ToolState tool = world_.tool(user->seat.tool);
    const BodyId held = tool.held;
    update.users.push_back({user->seat.user, tool.tool, held, user->seat.tool, tool.has_handle, tool.handle,
                            user->input.handle_age(), user->input.on_hand_W});
    const auto body = std::ranges::find(update.bodies, held, &proto::BodyState::id);
    // If several users hold the body, the update names the user in the first seat.
    if (body != update.bodies.end() && !body->held_by.is_valid()) body->held_by = user->seat.user;
  }
  proto::OwnUpdate common;
  common.step = step_;
  common.stepped = now;
  common.tick_faults = faults;
  common.field_energy_kj_per_mol = world_.field_energy_kj_per_mol();
  for (std::size_t seat = 0; seat < users_.size(); ++seat) describe_user(seat, common);
}

void Room::describe_user(std::size_t seat, const proto::OwnUpdate& common) noexcept {
  const User& user = *users_[seat];
  RoomUpdate& update = output_.back();
  update.user[seat] = user.seat.user;
  if (!user.seat.user.is_valid()) return;
  update.requests_served[seat] = user.requests_served;
  update.own[seat] = common;
  update.own[seat].answered_input = user.input.answered;
  if (user.seat.is_manipulator()) describe_tool(user, update.own[seat]);
}

void Room::describe_tool(const User& user, proto::OwnUpdate& update) const noexcept {
  const physics::ToolState tool = world_.tool(user.seat.tool);
  update.tool = tool.tool;
  update.wrench_on_hand_W = tool.wrench_on_hand_W;
  update.held_body = tool.held;
  if (tool.held.is_valid()) update.X_BT = world_.body(tool.held).X.inverse() * tool.tool.X;
  update.energy_into_world_j = tool.energy_into_world_j;
  update.energy_from_world_j = tool.energy_from_world_j;
  update.soft_contact = world_.soft_contact(user.seat.tool);
  if (user.input.has_arrived) user.driver->describe(update);
}

Tick Room::answered(std::size_t tool) const {
  const auto moves = [tool](const auto& user) { return user->seat.is_manipulator() && user->seat.tool == tool; };
  const auto user = std::find_if(users_.begin(), users_.end(), moves);
  return user == users_.end() ? Tick{} : (*user)->input.answered;
}

void Room::emit(const RoomEvent& event) noexcept {
  if (!events_.push(event)) ++events_lost_;
}

}  // namespace tandem::server

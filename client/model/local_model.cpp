#include "client/model/local_model.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/physics/followed_bodies.hpp"

namespace tandem::client {
namespace {

/// Length of the input history [ticks]. The model is not reconciled at longer round trips.
constexpr std::size_t kInputsKept = 2048;
/// Divergence: the tool or a touched body differs from the server's by more than kDivergence_m for kDivergence_s. The
/// model is then reset to the server's state, because the tool is probably on opposite sides of an obstacle in model
/// and server.
constexpr double kDivergence_m = 0.006;
constexpr double kDivergence_s = 0.1;
/// Maximum time by which one received state may increase the duration of a divergence. So a single state after a
/// silence cannot reset the model: at least four successive states must differ.
constexpr double kMaxStateInterval_s = kDivergence_s / 4;
/// Period of the client's haptic loop and of the model. It does not depend on the step rate of the room.
constexpr Duration kInputPeriod{std::chrono::milliseconds(1)};
/// Time constant of the low-pass filter of the loop delay.
constexpr double kLoopDelaySmoothing_s = 0.5;

std::shared_ptr<const physics::WorldDescription> for_a_client(
    const std::shared_ptr<const physics::WorldDescription>& description, const ModelErrors& errors) {
  auto copy = std::make_shared<physics::WorldDescription>(*description);
  // The server sends the coefficients that a law computes for a tool, so the fit is not needed here.
  copy->coupling.fit.reset();
  copy->step_s = to_seconds(kInputPeriod);
  for (physics::BodyDescription& body : copy->bodies) {
    body.mass.mass_kg *= errors.mass_scale;
    body.mass.principal_inertia_kg_m2 *= errors.mass_scale;
    body.traits.friction *= errors.friction_scale * errors.friction_scale;
    for (physics::TouchModel::Part& part : body.touch.parts) part.X_BS.p += errors.shape_shift_m;
    body.touch.radius_m += errors.shape_shift_m.norm();
  }
  return copy;
}

std::vector<BodyCopy> copies_of(const physics::WorldDescription& description, const ReconcilerSettings& settings) {
  std::vector<BodyCopy> copies;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    if (description.bodies[i].mass.mass_kg > 0) copies.emplace_back(body_id_at(i), settings);
  }
  return copies;
}

/// Returns the time from the input `answered` to the reception of its answer.
Duration loop_of(const LocalModelInput& input, Tick answered) {
  return kInputPeriod * static_cast<int>(input.input.value - answered.value);
}

}  // namespace

LocalModel::State::State(const physics::WorldDescription& description, const LocalModelSettings& settings)
    : bodies(copies_of(description, settings.body)),
      history(kInputsKept, bodies.size()),
      tool_reconciler(settings.tool),
      playout(settings.playout) {}

LocalModel::LocalModel(const std::shared_ptr<const physics::WorldDescription>& description, std::size_t tool,
                       const LocalModelSettings& settings)
    : settings_(settings),
      tool_(tool),
      tools_(description->tools.size()),
      step_s_(to_seconds(kInputPeriod)),
      world_(for_a_client(description, settings.errors), physics::make_followed_bodies(description->bodies.size()),
             nullptr),
      state_(*description, settings) {
  // A body is absent from the model until the server has sent the body's state.
  for (const BodyCopy& body : state_.bodies) world_.remove_body(body.id());
}

LocalModel::~LocalModel() = default;

Wrench LocalModel::step(const LocalModelInput& input) noexcept {
  if (input.newest == nullptr) return {};
  if (!state_.has_started) start(input.newest->update, *input.scene);
  follow_game(*input.scene);
  if (input.is_new) receive_update(input);
  set_couplings(*input.scene);
  follow_buttons(input);
  drive_bodies(input);
  correct_tool();
  follow_soft_contact(input.newest->update, input.is_new);
  if (input.has_handle) {
    world_.set_handle(tool_, input.handle);
  } else {
    world_.clear_handle(tool_);
  }
  faults_ = world_.step();
  state_.tool = world_.tool(tool_);
  remember(input.input);
  return input.has_handle ? state_.tool.wrench_on_hand_W : Wrench{};
}

// Starts from the server's state. The force needs no blend, because the safety chain ramps it up from zero.
void LocalModel::start(const proto::ServerUpdate& update, const HapticScene& scene) noexcept {
  state_.has_started = true;
  if (scene.gravity_m_per_s2) world_.jump_gravity(*scene.gravity_m_per_s2);
  world_.activate_tool(tool_, false);
  for (const proto::BodyState& received : update.bodies) world_.set_body(received.id, received.state);
  if (update.held_body.is_valid()) {
    world_.hold(tool_, update.held_body, update.X_BT);
  } else {
    world_.set_tool(tool_, update.tool);
  }
  state_.tool = world_.tool(tool_);
}

// Continues from the state of another model. The poses of bodies and tools are copied to this model's world. The member
// state_ is swapped as a whole, which needs no allocation and cannot omit a value.
void LocalModel::continue_from(LocalModel& other, const HapticScene& scene) noexcept {
  const bool is_alike =
      state_.bodies.size() == other.state_.bodies.size() && tools_ == other.tools_ && tool_ == other.tool_;
  if (has_started() || !other.has_started() || !is_alike) return;
  const PartnerTools& partners = other.state_.partners;
  world_.set_coupling(haptics::coupling_laws()[scene.law], scene.coupling);
  world_.set_coupling_bounds(tool_, scene.coupling_bounds[tool_]);
  partners.bound_all_couplings(world_, scene);
  world_.jump_gravity(other.world_.gravity());
  for (const BodyCopy& body : other.state_.bodies) {
    if (body.is_known()) world_.set_body(body.id(), other.body(body.id()));
  }
  set_tool_state(world_, tool_, other.world_.tool(tool_));
  partners.continue_in(world_, other.world_);
  std::swap(state_, other.state_);
  state_.tool = world_.tool(tool_);
}

void LocalModel::receive_update(const LocalModelInput& input) noexcept {
  const proto::ServerUpdate& update = input.newest->update;
  state_.playout.add(update.stepped.time_since_epoch(), input.newest->received.time_since_epoch());
  note_jump(state_.partners.receive(update, world_));
  const ModelThen* const then = state_.history.find(update.answered_input);
  receive_bodies(update, then);
  if (then != nullptr) {
    const double interval_s = interval_to(input.now);
    update_loop_delay(loop_of(input, update.answered_input), interval_s);
    compare_tool(update, *then, input, interval_s);
  }
  mirror_grasp(update);
}

void LocalModel::receive_bodies(const proto::ServerUpdate& update, const ModelThen* then) noexcept {
  const std::span<const BodyThen> bodies_then = state_.history.bodies(update.answered_input);
  for (std::size_t i = 0; i < state_.bodies.size(); ++i) {
    BodyCopy& body = state_.bodies[i];
    const auto received = std::ranges::find(update.bodies, body.id(), &proto::BodyState::id);
    if (received == update.bodies.end() || is_absent_in_game(body.id())) continue;
    body.receive(update.stepped.time_since_epoch(), received->state, then != nullptr ? &bodies_then[i] : nullptr,
                 world_);
  }
}

/// Returns the time since the previous state was compared with the model, at most kMaxStateInterval_s; for the first
/// compared state, one period.
double LocalModel::interval_to(LocalTime now) noexcept {
  const std::optional<LocalTime> before = std::exchange(state_.compared_at, now);
  return before ? std::clamp(to_seconds(now - *before), 0.0, kMaxStateInterval_s) : step_s_;
}

void LocalModel::update_loop_delay(Duration loop, double interval_s) noexcept {
  Duration& delay = state_.loop_delay;
  const double part = delay == Duration{0} ? 1.0 : std::min(1.0, interval_s / kLoopDelaySmoothing_s);
  delay += std::chrono::duration_cast<Duration>((loop + state_.playout.delay() - delay) * part);
}

void LocalModel::compare_tool(const proto::ServerUpdate& update, const ModelThen& then, const LocalModelInput& input,
                              double interval_s) noexcept {
  state_.newest_residual = update.wrench_on_hand_W - then.on_hand_W;
  state_.residual = state_.newest_residual;
  state_.residual_of = input.now - loop_of(input, update.answered_input);
  if (update.held_body.is_valid() || state_.tool.held.is_valid()) {
    state_.diverged_s = 0;
    return;
  }
  state_.tool_reconciler.observe(update.tool, then.tool, then.tool_given);
  double farthest_m = state_.tool_reconciler.error_m();
  for (const BodyCopy& body : state_.bodies) farthest_m = std::max(farthest_m, body.touched_error_m());
  state_.diverged_s = farthest_m > kDivergence_m ? state_.diverged_s + interval_s : 0;
  if (state_.diverged_s >= kDivergence_s) restart_from(update);
}

/// Resets the model to the server's state after a divergence.
void LocalModel::restart_from(const proto::ServerUpdate& update) noexcept {
  for (BodyCopy& body : state_.bodies) body.restart(world_);
  state_.partners.restart(world_);
  world_.set_tool(tool_, update.tool);
  state_.tool_reconciler.reset();
  state_.diverged_s = 0;
  note_jump(true);
}

void LocalModel::mirror_grasp(const proto::ServerUpdate& update) noexcept {
  // Ignores a held body that is absent from the present level of the game: the update was sent before the level
  // changed.
  if (update.held_body.is_valid() && is_absent_in_game(update.held_body)) return;
  note_jump(state_.grasp.mirror(update, state_.tool.tool.X, grip_step_m(), world_, tool_));
}

void LocalModel::set_couplings(const HapticScene& scene) noexcept {
  world_.set_coupling(haptics::coupling_laws()[scene.law], scene.coupling);
  world_.set_coupling_bounds(tool_, scene.coupling_bounds[tool_]);
  state_.partners.bound_couplings(world_, scene);
}

/// Removes the bodies that are absent from the present level of a game. A movable body that is no longer absent returns
/// with its next state from the server. A change that the hand may feel is noted as a jump.
void LocalModel::follow_game(const HapticScene& scene) noexcept {
  if (scene.gravity_m_per_s2) world_.set_gravity(*scene.gravity_m_per_s2);
  const std::uint64_t before = std::exchange(absent_bodies_, scene.absent_bodies);
  for (std::uint64_t bits = before | absent_bodies_; bits != 0; bits &= bits - 1) {
    const BodyId id = body_id_at(static_cast<std::size_t>(std::countr_zero(bits)));
    const auto copy = std::ranges::find(state_.bodies, id, &BodyCopy::id);
    const bool has_changed = ((before ^ absent_bodies_) >> (id.value - 1) & 1U) != 0;
    if (copy == state_.bodies.end()) note_jump(has_changed);
    if (!is_absent_in_game(id)) {
      if (copy == state_.bodies.end()) world_.restore_body(id);
    } else if (copy == state_.bodies.end()) {
      world_.remove_body(id);
    } else if (!world_.is_absent(id)) {
      note_jump(state_.tool.held == id || (world_.hands_on(id) >> tool_ & 1U) != 0);
      copy->forget(world_);
    }
  }
}

void LocalModel::follow_buttons(const LocalModelInput& input) noexcept {
  if (!input.has_handle) return;
  const bool is_down = (input.buttons & kButtonGrab) != 0;
  note_jump(state_.grasp.follow_button(is_down, input.input, input.now, world_, tool_));
}

void LocalModel::drive_bodies(const LocalModelInput& input) noexcept {
  if (!state_.playout.has_started()) return;
  const Duration now = input.now.time_since_epoch();
  const ModelStep step = step_at(state_.playout.play_at(now), now + input.newest->clock_offset);
  for (BodyCopy& body : state_.bodies) body.follow_touches(step);
  note_jump(state_.partners.drive(step, state_.bodies, input.predicts_partners, tools_));
  for (BodyCopy& body : state_.bodies) {
    const bool is_partners = state_.partners.is_holding(body.id()) && step.held != body.id();
    body.move(step, is_partners);
  }
}

ModelStep LocalModel::step_at(Duration played, Duration present) noexcept {
  return {.world = world_,
          .tool = tool_,
          .held = state_.tool.held,
          .period_s = step_s_,
          .loop_delay = state_.loop_delay,
          .played = played,
          .present = present,
          .longest_extrapolation = settings_.longest_extrapolation,
          .farthest_extrapolation_m = settings_.farthest_extrapolation_m,
          .grip_step_m = grip_step_m()};
}

void LocalModel::correct_tool() noexcept {
  if (state_.tool.held.is_valid()) return;
  const Shift shift = state_.tool_reconciler.step(step_s_, to_seconds(state_.loop_delay));
  world_.shift_tool(tool_, pose_of(shift), {shift.v, shift.w});
}

// A soft contact acts on the held body, or on the tool if it holds no body. A received contact is ignored if model and
// server disagree on the held body.
void LocalModel::follow_soft_contact(const proto::ServerUpdate& update, bool is_new) noexcept {
  const BodyId held = state_.tool.held;
  const Pose X_WT = held.is_valid() ? world_.body(held).X : state_.tool.tool.X;
  state_.soft.attach_to(held);
  if (is_new && update.held_body == held) state_.soft.receive(update.soft_contact, X_WT);
  SoftContact here;
  here.wrench_W = state_.soft.step(X_WT, step_s_);
  here.X_WT0 = X_WT;
  here.trust_radius_m = here.wrench_W.f.norm() + here.wrench_W.t.norm() > 0 ? 1.0 : 0.0;
  world_.set_soft_contact(tool_, here);
}

void LocalModel::remember(Tick input) noexcept {
  ModelThen& model = state_.history.add(input);
  model.tool = state_.tool.tool;
  model.tool_given = state_.tool_reconciler.given();
  model.on_hand_W = state_.tool.wrench_on_hand_W;
  const std::span<BodyThen> bodies = state_.history.bodies(input);
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i] = state_.bodies[i].recorded(world_);
}

std::optional<Wrench> LocalModel::pop_residual() noexcept {
  return std::exchange(state_.residual, std::nullopt);
}

bool LocalModel::pop_jump() noexcept {
  return std::exchange(state_.has_jumped, false);
}

}  // namespace tandem::client

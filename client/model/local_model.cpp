#include "client/model/local_model.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/physics/followed_bodies.hpp"

namespace tandem::client {
namespace {

/// Length of the input history; longer round trips are not reconciled.
constexpr std::size_t kInputsKept = 2048;
/// A touch counts for this long, so that a body remains predicted between two taps.
constexpr double kTouchKept_s = 0.05;
/// Prediction continues for this time plus the loop delay after the last touch, until the server's answer to it
/// arrives.
constexpr double kImplicitAfterTouch_s = 0.25;
/// Time constant with which the offset of a body that begins to follow the server fades.
constexpr double kFollowTime_s = 0.08;
/// Divergence: a tool that is so far from the server's for so long is on the other side of an obstacle. It is reset to
/// the server's state.
constexpr double kDivergence_m = 0.006;
constexpr double kDivergence_s = 0.1;
/// Number of inputs after a button press within which the server grants or refuses the grasp.
constexpr std::uint64_t kGraspAnsweredAfter = 5;
/// Period of the client's loop and model, whatever the room's rate.
constexpr Duration kInputPeriod{std::chrono::milliseconds(1)};
/// A user without a received state for this long has left.
constexpr Duration kHoldKept = std::chrono::seconds(1);
/// Time constant of the loop delay's low pass.
constexpr double kLoopDelaySmoothing_s = 0.5;

std::shared_ptr<const physics::WorldDescription> for_a_client(
    const std::shared_ptr<const physics::WorldDescription>& description, const ModelErrors& errors) {
  auto copy = std::make_shared<physics::WorldDescription>(*description);
  // The server sends the coefficients that the law chooses for a tool.
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

Shift faded(const Shift& shift, double period_s) {
  return shift * std::exp(-period_s / kFollowTime_s);
}

RigidState shifted(const RigidState& state, const Shift& shift) {
  return {{state.X.p + shift.p, (quaternion_of(shift.theta) * state.X.q).normalized()}, state.V};
}

Pose pose_of(const Shift& shift) {
  return {shift.p, quaternion_of(shift.theta)};
}

}  // namespace

LocalModel::LocalModel(const std::shared_ptr<const physics::WorldDescription>& description, std::size_t tool,
                       const LocalModelSettings& settings)
    : settings_(settings),
      tool_(tool),
      tools_(description->tools.size()),
      step_s_(to_seconds(kInputPeriod)),
      world_(for_a_client(description, settings.errors), physics::make_followed_bodies(description->bodies.size()),
             nullptr),
      copies_(copies_of(*description, settings)),
      history_(kInputsKept, copies_.size()),
      tool_reconciler_(settings.tool),
      playout_(settings.playout) {
  partners_.reserve(proto::kMaxUsers);
  // Bodies are absent from the model until the server has sent their state.
  for (const Copy& copy : copies_) world_.remove_body(copy.id);
}

LocalModel::~LocalModel() = default;

std::vector<LocalModel::Copy> LocalModel::copies_of(const physics::WorldDescription& description,
                                                    const LocalModelSettings& settings) {
  std::vector<Copy> copies;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    const physics::BodyDescription& body = description.bodies[i];
    if (body.mass.mass_kg > 0) copies.emplace_back(body_id_at(i), settings);
  }
  return copies;
}

Wrench LocalModel::step(const LocalModelInput& input) noexcept {
  if (input.newest == nullptr) return {};
  if (!has_started_) start(input.newest->update);
  if (input.is_new) receive_update(input);
  world_.set_coupling(haptics::coupling_laws()[input.scene->law], input.scene->coupling);
  world_.set_coupling_bounds(tool_, input.scene->coupling_bounds[tool_]);
  for (const PartnerHere& here : partners_) {
    if (here.is_here) world_.set_coupling_bounds(here.tool, input.scene->coupling_bounds[here.tool]);
  }
  follow_buttons(input);
  drive_copies(input, step_s_);
  correct_tool(step_s_);
  follow_soft_contact(input.newest->update, input.is_new, step_s_);
  if (input.has_handle) {
    world_.set_handle(tool_, input.handle);
  } else {
    world_.clear_handle(tool_);
  }
  faults_ = world_.step();
  tool_state_ = world_.tool(tool_);
  remember(input.input);
  return input.has_handle ? tool_state_.wrench_on_hand_W : Wrench{};
}

// Starts from the server's state. The first force is under the start ramp, so no blend is needed.
void LocalModel::start(const proto::ServerUpdate& update) noexcept {
  has_started_ = true;
  world_.activate_tool(tool_, false);
  for (const proto::BodyState& received : update.bodies) world_.set_body(received.id, received.state);
  if (update.held_body.is_valid()) {
    world_.hold(tool_, update.held_body, update.X_BT);
  } else {
    world_.set_tool(tool_, update.tool);
  }
  tool_state_ = world_.tool(tool_);
}

// Containers whose size depends on the scene are swapped, so nothing is allocated.
void LocalModel::continue_from(LocalModel& other, const HapticScene& scene) noexcept {
  const bool is_alike = copies_.size() == other.copies_.size() && tools_ == other.tools_ && tool_ == other.tool_;
  if (has_started_ || !other.has_started_ || !is_alike) return;
  has_started_ = true;
  world_.set_coupling(haptics::coupling_laws()[scene.law], scene.coupling);
  world_.set_coupling_bounds(tool_, scene.coupling_bounds[tool_]);
  for (const PartnerHere& here : other.partners_)
    world_.set_coupling_bounds(here.tool, scene.coupling_bounds[here.tool]);
  for (const Copy& copy : other.copies_) {
    if (copy.is_known) world_.set_body(copy.id, other.world_.body(copy.id));
  }
  set_tool_state(tool_, other.world_.tool(tool_));
  for (const PartnerHere& here : other.partners_) {
    if (here.is_here) set_tool_state(here.tool, other.world_.tool(here.tool));
  }
  std::swap(copies_, other.copies_);
  std::swap(history_, other.history_);
  std::swap(partners_, other.partners_);
  tool_reconciler_ = other.tool_reconciler_;
  playout_ = other.playout_;
  loop_delay_ = other.loop_delay_;
  residual_ = other.residual_;
  newest_residual_ = other.newest_residual_;
  residual_of_ = other.residual_of_;
  predicted_grasp_ = other.predicted_grasp_;
  predicted_grasp_at_ = other.predicted_grasp_at_;
  grab_button_ = other.grab_button_;
  diverged_s_ = other.diverged_s_;
  soft_ = other.soft_;
  soft_of_ = other.soft_of_;
  tool_state_ = world_.tool(tool_);
}

void LocalModel::set_tool_state(std::size_t tool, const physics::ToolState& state) noexcept {
  world_.activate_tool(tool, false);
  if (state.held.is_valid()) {
    world_.hold(tool, state.held, world_.body(state.held).X.inverse() * state.tool.X);
  } else {
    world_.set_tool(tool, state.tool);
  }
}

void LocalModel::receive_update(const LocalModelInput& input) noexcept {
  const proto::ServerUpdate& update = input.newest->update;
  const Duration stepped = update.stepped.time_since_epoch();
  playout_.add(stepped, input.newest->received.time_since_epoch());
  receive_partners(update);
  const ModelThen* const then = history_.find(update.answered_input);
  for (Copy& copy : copies_) {
    const auto received = std::find_if(update.bodies.begin(), update.bodies.end(),
                                       [&copy](const proto::BodyState& body) { return body.id == copy.id; });
    if (received == update.bodies.end()) continue;
    if (!std::exchange(copy.is_known, true)) world_.set_body(copy.id, received->state);
    copy.track.add(stepped, received->state);
    if (then == nullptr) continue;
    const BodyThen& body_then =
        history_.bodies(update.answered_input)[static_cast<std::size_t>(&copy - copies_.data())];
    if (body_then.is_implicit) copy.reconciler.observe(received->state, body_then.state, body_then.given);
  }
  if (then != nullptr) {
    const Duration loop = kInputPeriod * static_cast<int>(input.input.value - update.answered_input.value);
    const double part = loop_delay_ == Duration{0} ? 1.0 : std::min(1.0, step_s_ / kLoopDelaySmoothing_s);
    loop_delay_ += std::chrono::duration_cast<Duration>((loop + playout_.delay() - loop_delay_) * part);
    compare_tool(update, *then, input);
  }
  mirror_grasp(update);
}

void LocalModel::receive_partners(const proto::ServerUpdate& update) noexcept {
  for (const proto::OtherUserState& received : update.users) {
    auto known = std::find_if(partners_.begin(), partners_.end(),
                              [&received](const PartnerHere& here) { return here.partner.id() == received.id; });
    if (known == partners_.end()) {
      if (partners_.size() == partners_.capacity()) continue;
      partners_.push_back({Partner(received.id), 0, false, {}});
      known = partners_.end() - 1;
    }
    known->partner.receive(received, update);
  }
  const auto has_left = [&update](const PartnerHere& here) {
    return update.stepped - here.partner.received_at() > kHoldKept;
  };
  for (PartnerHere& here : partners_) {
    const Partner& partner = here.partner;
    if (here.is_here && (has_left(here) || !partner.has_handle() || partner.tool() != here.tool)) remove_partner(here);
    if (here.held.is_valid() && here.held != partner.holds()) {
      world_.release(here.tool);
      here.held = BodyId{};
    }
  }
  std::erase_if(partners_, has_left);
}

void LocalModel::remove_partner(PartnerHere& here) noexcept {
  world_.deactivate_tool(here.tool);
  has_jumped_ = has_jumped_ || here.is_here;
  here.is_here = false;
  here.held = BodyId{};
}

bool LocalModel::is_held_by_partner(BodyId body) const noexcept {
  return std::any_of(partners_.begin(), partners_.end(), [body](const PartnerHere& here) { return here.held == body; });
}

/// Adds the partner's tool at the server's pose, and lets it hold its body at the received grip.
void LocalModel::bring_in(PartnerHere& here) noexcept {
  const Partner& partner = here.partner;
  if (!here.is_here) {
    here.tool = partner.tool();
    // activate_tool() is called without the scene's initial grasp; the grip below comes from the server.
    world_.activate_tool(here.tool, false);
    world_.set_tool(here.tool, partner.received_tool());
    here.is_here = true;
    has_jumped_ = true;
  }
  if (here.held.is_valid() && here.held == partner.holds() && partner.place()) {
    // Moves the grip if the server moved it (Room::place()); smaller differences come from the delay of a moving body.
    constexpr double kElsewhere_m = 0.005;
    const Pose X_BT = world_.body(here.held).X.inverse() * world_.tool(here.tool).tool.X;
    if ((X_BT.p - partner.place()->p).norm() > kElsewhere_m) {
      world_.move_grip(here.tool, *partner.place(), settings_.body.speed_limit_m_per_s * step_s_);
    }
    return;
  }
  if (here.held.is_valid() || !partner.holds().is_valid() || !partner.place()) return;
  const auto is_it = [&partner](const Copy& copy) { return copy.id == partner.holds() && copy.is_known; };
  if (std::none_of(copies_.begin(), copies_.end(), is_it)) return;
  world_.hold(here.tool, partner.holds(), *partner.place());
  here.held = partner.holds();
}

PartnerSurroundings LocalModel::surroundings_of(const PartnerHere& here, Duration played) noexcept {
  PartnerSurroundings around;
  if (!here.is_here) return around;
  around.on_hand_W = world_.tool(here.tool).wrench_on_hand_W;
  for (const Copy& copy : copies_) {
    if (!copy.is_known) continue;
    const std::uint32_t hands = world_.hands_on(copy.id);
    const bool is_held = here.held == copy.id;
    if ((hands >> here.tool & 1U) == 0 || (hands >> tool_ & 1U) == 0) continue;
    around.is_coupled = true;
    const Vec3 pressing_W = is_held ? Vec3(Vec3::Zero()) : world_.pressing_normal_W(here.tool, copy.id);
    // A body that this user moves only through another one does not follow this hand, so it is no common body.
    const bool has_own_hand = tool_state_.held == copy.id || !world_.pressing_normal_W(tool_, copy.id).isZero();
    if (!has_own_hand || (!is_held && pressing_W.isZero())) continue;
    around.has_common_body = true;
    around.body = world_.body(copy.id);
    around.X_WB_then = copy.track.at(played).X;
    around.is_held = is_held;
    around.pressing_W = pressing_W;
    break;
  }
  return around;
}

/// Steps partners' tools locally, so that they respond to this user's hand without delay.
void LocalModel::drive_partners(const LocalModelInput& input, Duration played, Duration present,
                                double period_s) noexcept {
  for (PartnerHere& here : partners_) {
    const bool is_tool = here.partner.tool() < tools_ && here.partner.tool() != tool_;
    if (!here.partner.has_handle() || !is_tool) continue;
    PartnerSurroundings around = surroundings_of(here, played);
    around.is_predicted = input.predicts_partners;
    const RigidState handle = here.partner.predict(played, to_seconds(present - played), around, period_s);
    bring_in(here);
    world_.set_handle(here.tool, handle);
  }
}

void LocalModel::compare_tool(const proto::ServerUpdate& update, const ModelThen& then,
                              const LocalModelInput& input) noexcept {
  const Duration ago = kInputPeriod * static_cast<int>(input.input.value - update.answered_input.value);
  newest_residual_ = update.wrench_on_hand_W - then.on_hand_W;
  residual_ = newest_residual_;
  residual_of_ = input.now - ago;
  if (update.held_body.is_valid() || tool_state_.held.is_valid()) {
    diverged_s_ = 0;
    return;
  }
  tool_reconciler_.observe(update.tool, then.tool, then.tool_given);
  double farthest_m = tool_reconciler_.error_m();
  for (const Copy& copy : copies_) {
    if (!copy.was_followed && copy.is_touched()) farthest_m = std::max(farthest_m, copy.reconciler.error_m());
  }
  diverged_s_ = farthest_m > kDivergence_m ? diverged_s_ + step_s_ : 0;
  if (diverged_s_ < kDivergence_s) return;
  for (Copy& copy : copies_) {
    if (copy.was_followed || !copy.is_known) continue;
    world_.set_body(copy.id, copy.track.newest());
    copy.reconciler.reset();
  }
  for (const PartnerHere& here : partners_) {
    if (here.is_here && !here.held.is_valid()) world_.set_tool(here.tool, here.partner.received_tool());
  }
  world_.set_tool(tool_, update.tool);
  tool_reconciler_.reset();
  diverged_s_ = 0;
  has_jumped_ = true;
}

void LocalModel::mirror_grasp(const proto::ServerUpdate& update) noexcept {
  if (predicted_grasp_) {
    // A new grasp: keeps the prediction until the server has received the button. A hand that is extrapolated through a
    // gap at the server is ahead of its buttons.
    const bool has_come = update.echoed_sent == LocalTime{} || update.echoed_sent >= predicted_grasp_at_;
    if (!has_come || update.answered_input.value < predicted_grasp_->value + kGraspAnsweredAfter) return;
  }
  predicted_grasp_.reset();
  const BodyId held = world_.tool(tool_).held;
  if (held == update.held_body) {
    if (held.is_valid()) world_.move_grip(tool_, update.X_BT, settings_.body.speed_limit_m_per_s * step_s_);
    return;
  }
  has_jumped_ = true;
  if (!update.held_body.is_valid()) return world_.release(tool_);
  // Grasps at the tool's current pose on the local copy; the grip then moves to the server's.
  const Pose X_BT = world_.body(update.held_body).X.inverse() * tool_state_.tool.X;
  world_.hold(tool_, update.held_body, X_BT);
}

// Predicts the server's handling of the same input; mirror_grasp() corrects a different outcome.
void LocalModel::follow_buttons(const LocalModelInput& input) noexcept {
  const bool is_down = (input.buttons & kButtonGrab) != 0;
  if (is_down == grab_button_ || !input.has_handle) return;
  grab_button_ = is_down;
  predicted_grasp_ = input.input;
  predicted_grasp_at_ = input.now;
  const BodyId before = world_.tool(tool_).held;
  if (is_down) {
    world_.grab(tool_, BodyId{});
  } else {
    world_.release(tool_);
  }
  has_jumped_ = has_jumped_ || world_.tool(tool_).held != before;
}

bool LocalModel::Copy::is_touched() const {
  return untouched_s < kTouchKept_s;
}

bool LocalModel::is_implicit(const Copy& copy) const noexcept {
  return copy.unpressed_s < kTouchKept_s || copy.untouched_s < kImplicitAfterTouch_s + to_seconds(loop_delay_);
}

void LocalModel::follow_touches(double period_s) noexcept {
  for (Copy& copy : copies_) {
    const std::uint32_t hands = world_.hands_on(copy.id);
    copy.untouched_s = (hands >> tool_ & 1U) != 0 ? 0 : copy.untouched_s + period_s;
    copy.unpressed_s = hands != 0 ? 0 : copy.unpressed_s + period_s;
  }
}

void LocalModel::drive_copies(const LocalModelInput& input, double period_s) noexcept {
  if (!playout_.has_started()) return;
  const Duration played = playout_.play_at(input.now.time_since_epoch());
  const Duration present = input.now.time_since_epoch() + input.newest->clock_offset;
  follow_touches(period_s);
  drive_partners(input, played, present, period_s);
  for (Copy& copy : copies_) {
    if (!copy.is_known) continue;
    if (is_implicit(copy)) {
      reconcile(copy, period_s);
    } else {
      follow(copy, played, present, period_s);
    }
  }
}

/// A body that only a partner holds follows the partner's predicted hand: a correction would be felt as the partner's
/// force.
void LocalModel::reconcile(Copy& copy, double period_s) noexcept {
  copy.was_followed = false;
  world_.keep_implicit(copy.id, 2 * period_s);
  const bool is_partners = is_held_by_partner(copy.id) && tool_state_.held != copy.id;
  if (is_partners) return;
  const Shift shift = copy.reconciler.step(period_s, to_seconds(loop_delay_));
  world_.shift_body(copy.id, pose_of(shift), {shift.v, shift.w});
}

RigidState LocalModel::seen_at_present(const Copy& copy, Duration played, Duration present) const noexcept {
  RigidState target = copy.track.at(played);
  const Duration ahead = std::clamp(present - played, Duration{0}, settings_.longest_extrapolation);
  const double speed = target.V.v.norm();
  double ahead_s = to_seconds(ahead);
  if (speed * ahead_s > settings_.farthest_extrapolation_m) ahead_s = settings_.farthest_extrapolation_m / speed;
  target.X = integrate(target.X, target.V, ahead_s);
  return target;
}

void LocalModel::follow(Copy& copy, Duration played, Duration present, double period_s) noexcept {
  const RigidState target = seen_at_present(copy, played, present);
  if (!copy.was_followed) {
    copy.offset = shift_between(target, world_.body(copy.id));
    copy.reconciler.reset();
    world_.keep_implicit(copy.id, 0);
    copy.was_followed = true;
  }
  copy.offset = faded(copy.offset, period_s);
  world_.set_body(copy.id, shifted(target, copy.offset));
}

void LocalModel::correct_tool(double period_s) noexcept {
  if (tool_state_.held.is_valid()) return;
  const Shift shift = tool_reconciler_.step(period_s, to_seconds(loop_delay_));
  world_.shift_tool(tool_, pose_of(shift), {shift.v, shift.w});
}

void LocalModel::follow_soft_contact(const proto::ServerUpdate& update, bool is_new, double period_s) noexcept {
  const Pose X_WT = tool_state_.held.is_valid() ? world_.body(tool_state_.held).X : tool_state_.tool.X;
  // A soft contact acts on the held body or else on the tool; one for another body is ignored.
  if (std::exchange(soft_of_, tool_state_.held) != tool_state_.held) soft_ = SoftFollower{};
  if (is_new && update.held_body == tool_state_.held) soft_.receive(update.soft_contact, X_WT);
  SoftContact here;
  here.wrench_W = soft_.step(X_WT, period_s);
  here.X_WT0 = X_WT;
  here.trust_radius_m = here.wrench_W.f.norm() + here.wrench_W.t.norm() > 0 ? 1.0 : 0.0;
  world_.set_soft_contact(tool_, here);
}

void LocalModel::remember(Tick input) noexcept {
  ModelThen& model = history_.add(input);
  model.tool = tool_state_.tool;
  model.tool_given = tool_reconciler_.given();
  model.on_hand_W = tool_state_.wrench_on_hand_W;
  const std::span<BodyThen> bodies = history_.bodies(input);
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    const Copy& copy = copies_[i];
    bodies[i] = {world_.body(copy.id), copy.reconciler.given(), !copy.was_followed};
  }
}

std::optional<Wrench> LocalModel::pop_residual() noexcept {
  return std::exchange(residual_, std::nullopt);
}

RigidState LocalModel::partner_tool(UserId user, const RigidState& received) const noexcept {
  const auto is_it = [user](const PartnerHere& here) { return here.is_here && here.partner.id() == user; };
  const auto found = std::find_if(partners_.begin(), partners_.end(), is_it);
  return found == partners_.end() ? received : world_.tool(found->tool).tool;
}

double LocalModel::common_share() const noexcept {
  double share = 0;
  bool is_alone = true;
  for (const PartnerHere& here : partners_) {
    if (!here.is_here) continue;
    is_alone = false;
    share = std::max(share, here.partner.common_share());
  }
  return is_alone ? 1 : share;
}

bool LocalModel::pop_jump() noexcept {
  return std::exchange(has_jumped_, false);
}

}  // namespace tandem::client

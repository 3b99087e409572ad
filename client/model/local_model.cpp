#include "client/model/local_model.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/physics/followed_bodies.hpp"

namespace tandem::client {
namespace {

/// Longer round trips than this are not reconciled.
constexpr std::size_t kInputsKept = 2048;
/// A tap counts as a touch for so long, so that a body is not given back between two of them.
constexpr double kTouchKept_s = 0.05;
/// Predicted on after the last touch for this beside the loop's delay: what the touch did has then come back.
constexpr double kImplicitAfterTouch_s = 0.25;
/// Where a body was when it began to be followed is forgotten within about three of these.
constexpr double kFollowTime_s = 0.08;
/// Where a joint acts follows a tool that slides.
constexpr double kJointPlace_s = 0.1;
/// Divergence: a tool so far from the server's, for so long, is on the other side of something, and snaps to where the
/// server has it.
constexpr double kDivergence_m = 0.01;
constexpr double kDivergence_s = 0.5;
/// The server grants or refuses what a button asks within so many inputs of the one that pressed it.
constexpr std::uint64_t kGraspAnsweredAfter = 5;
/// The client's loop, and so its model, runs at this whatever the room's rate.
constexpr Duration kInputPeriod{std::chrono::milliseconds(1)};
/// A user whom the server has not told of for so long has left.
constexpr Duration kHoldKept = std::chrono::seconds(1);
/// Of the smoothed loop delay: jitter does not move the joint's stiffness.
constexpr double kLoopDelaySmoothing_s = 0.5;

std::shared_ptr<const physics::WorldDescription> for_a_client(
    const std::shared_ptr<const physics::WorldDescription>& description, const ModelErrors& errors) {
  auto copy = std::make_shared<physics::WorldDescription>(*description);
  // What the law chooses for a tool comes from the server.
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
      step_s_(to_seconds(kInputPeriod)),
      world_(for_a_client(description, settings.errors), physics::make_followed_bodies(description->bodies.size()),
             nullptr),
      copies_(copies_of(*description, settings)),
      ledger_(world_, tool, settings.keeps_ledger),
      history_(kInputsKept, copies_.size()),
      tool_reconciler_(settings.tool),
      playout_(settings.playout) {
  for (const Copy& copy : copies_) ledger_.add(copy.id);
}

LocalModel::~LocalModel() = default;

std::vector<LocalModel::Copy> LocalModel::copies_of(const physics::WorldDescription& description,
                                                    const LocalModelSettings& settings) {
  std::vector<Copy> copies;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    const physics::BodyDescription& body = description.bodies[i];
    if (body.mass.mass_kg > 0) copies.emplace_back(body_id_at(i), body.molecule != nullptr, settings);
  }
  return copies;
}

Wrench LocalModel::step(const LocalModelInput& input) noexcept {
  if (input.newest == nullptr) return {};
  if (!has_started_) start(input.newest->update);
  if (input.is_new) take_update(input);
  newest_input_ = input.input;
  world_.set_coupling(input.coupling);
  follow_buttons(input);
  drive_copies(input, step_s_);
  correct_tool(step_s_);
  follow_soft_contact(input.newest->update, input.is_new, step_s_);
  if (input.has_handle) {
    world_.set_handle(tool_, input.handle);
  } else {
    world_.clear_handle(tool_);
  }
  ledger_.begin_step();
  faults_ = world_.step();
  ledger_.end_step();
  tool_state_ = world_.tool(tool_);
  remember(input.input);
  return input.has_handle ? tool_state_.wrench_on_hand_W : Wrench{};
}

// As the server has it: the first force comes under the start ramp, so nothing is blended.
void LocalModel::start(const proto::ServerUpdate& update) noexcept {
  has_started_ = true;
  world_.activate_tool(tool_);
  for (const proto::BodyState& told : update.bodies) world_.set_body(told.id, told.state);
  if (update.held_body.is_valid()) {
    world_.hold(tool_, update.held_body, update.X_BT);
  } else {
    world_.release(tool_);
    world_.set_tool(tool_, update.tool);
  }
  tool_state_ = world_.tool(tool_);
}

void LocalModel::take_update(const LocalModelInput& input) noexcept {
  const proto::ServerUpdate& update = input.newest->update;
  const Duration stepped = update.stepped.time_since_epoch();
  playout_.add(stepped, input.newest->received.time_since_epoch());
  slowest_loop_ = update.slowest_loop;
  told_held_ = update.held_body;
  note_holds(update);
  const ModelThen* const then = history_.find(update.answered_input);
  for (Copy& copy : copies_) {
    const auto told = std::find_if(update.bodies.begin(), update.bodies.end(),
                                   [&copy](const proto::BodyState& body) { return body.id == copy.id; });
    if (told == update.bodies.end()) continue;
    copy.is_known = true;
    copy.track.add(stepped, told->state, update.step.value);
    note_others(*told, copy, update);
    if (then == nullptr) continue;
    const BodyThen& body_then =
        history_.bodies(update.answered_input)[static_cast<std::size_t>(&copy - copies_.data())];
    if (body_then.is_implicit) copy.reconciler.observe(told->state, body_then.state, body_then.given);
  }
  if (then != nullptr) {
    const Duration loop = kInputPeriod * static_cast<int>(input.input.value - update.answered_input.value);
    const double part = loop_delay_ == Duration{0} ? 1.0 : std::min(1.0, step_s_ / kLoopDelaySmoothing_s);
    loop_delay_ += std::chrono::duration_cast<Duration>((loop + playout_.delay() - loop_delay_) * part);
    compare_tool(update, *then, input);
  }
  mirror_grasp(update);
}

void LocalModel::note_holds(const proto::ServerUpdate& update) noexcept {
  for (const proto::OtherUserState& told : update.users) {
    auto known = std::find_if(other_holds_.begin(), other_holds_.end(),
                              [&told](const OtherHold& other) { return other.user == told.id; });
    if (known == other_holds_.end()) {
      if (other_holds_.size() == other_holds_.capacity()) continue;
      known = other_holds_.insert(known, OtherHold{told.id, {}, {}});
    }
    known->body = told.holds;
    known->told = update.stepped;
  }
  const auto is_gone = [&update](const OtherHold& other) { return update.stepped - other.told > kHoldKept; };
  other_holds_.erase(std::remove_if(other_holds_.begin(), other_holds_.end(), is_gone), other_holds_.end());
}

/// The server counts our own hand too, some milliseconds before or after we felt the same touch.
void LocalModel::note_others(const proto::BodyState& told, Copy& copy, const proto::ServerUpdate& update) noexcept {
  const auto index = static_cast<std::size_t>(&copy - copies_.data());
  const auto holds_it = [&copy](const OtherHold& other) { return other.body == copy.id; };
  copy.other_holders = static_cast<std::size_t>(std::count_if(other_holds_.begin(), other_holds_.end(), holds_it));
  // Who has left is told of no more, but his hand is off the body at once.
  if (!physics::others_touch(told.hands, update.held_body == copy.id)) copy.other_holders = 0;
  if (copy.other_holders > 0) {
    copy.others_touch = true;
    return;
  }
  // Touches are remembered for kTouchKept_s; half of it later covers a touch that the server felt first.
  const Tick input = update.answered_input;
  const auto half_kept = static_cast<std::uint64_t>(0.5 * kTouchKept_s / step_s_);
  const bool is_mine = touched_then(index, input) || update.held_body == copy.id;
  const bool was_soon_mine = touched_then(index, Tick{std::min(input.value + half_kept, newest_input_.value)});
  // That one hand may then be ours or not: as it was.
  if (!is_mine && was_soon_mine && told.hands == 1) return;
  copy.others_touch = physics::others_touch(told.hands, is_mine);
}

bool LocalModel::touched_then(std::size_t copy, Tick input) noexcept {
  return history_.find(input) != nullptr && history_.bodies(input)[copy].is_touched;
}

void LocalModel::compare_tool(const proto::ServerUpdate& update, const ModelThen& then,
                              const LocalModelInput& input) noexcept {
  const Duration ago = kInputPeriod * static_cast<int>(input.input.value - update.answered_input.value);
  residual_ = update.wrench_on_hand_W - then.on_hand_W;
  residual_of_ = input.now - ago;
  // The joint holds the server's tool elsewhere than the handle's coupling holds ours.
  const bool is_alike =
      update.joint_share <= 0 && joint_share() <= 0 && !update.held_body.is_valid() && !tool_state_.held.is_valid();
  if (!is_alike) {
    diverged_s_ = 0;
    return;
  }
  tool_reconciler_.observe(update.tool, then.tool, then.tool_given);
  diverged_s_ = tool_reconciler_.error_m() > kDivergence_m ? diverged_s_ + step_s_ : 0;
  if (diverged_s_ < kDivergence_s) return;
  world_.set_tool(tool_, update.tool);
  tool_reconciler_.reset();
  diverged_s_ = 0;
  has_jumped_ = true;
}

void LocalModel::mirror_grasp(const proto::ServerUpdate& update) noexcept {
  if (predicted_grasp_ && update.answered_input.value < predicted_grasp_->value + kGraspAnsweredAfter) return;
  predicted_grasp_.reset();
  const BodyId held = world_.tool(tool_).held;
  if (held == update.held_body) {
    if (held.is_valid()) world_.move_grip(tool_, update.X_BT, settings_.body.speed_limit_m_per_s * step_s_);
    return;
  }
  has_jumped_ = true;
  if (!update.held_body.is_valid()) return world_.release(tool_);
  // Where our tool is on our copy; the grip then moves to where the server has it.
  const Pose X_BT = world_.body(update.held_body).X.inverse() * tool_state_.tool.X;
  world_.hold(tool_, update.held_body, X_BT);
}

// The server does the same with this input when it gets it; what it finds else is mirrored then.
void LocalModel::follow_buttons(const LocalModelInput& input) noexcept {
  const bool is_down = (input.buttons & kButtonGrab) != 0;
  if (is_down == grab_button_ || !input.has_handle) return;
  grab_button_ = is_down;
  predicted_grasp_ = input.input;
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
  return copy.is_touched() ||
         (!copy.others_touch && copy.untouched_s < kImplicitAfterTouch_s + to_seconds(loop_delay_));
}

double LocalModel::joint_share() const {
  double greatest = 0;
  for (const Copy& copy : copies_) greatest = std::max(greatest, copy.joint.share());
  return greatest;
}

/// A body that others hold, and that we begin to touch, has followed the server so far: it is joined to it at once.
/// Without, it would fall until its joint has come in.
void LocalModel::follow_touches(Duration now, double period_s) noexcept {
  bool is_shared = false;
  for (Copy& copy : copies_) {
    copy.untouched_s = touches(copy.id) ? 0 : copy.untouched_s + period_s;
    if (!copy.is_touched() || !copy.others_touch) continue;
    is_shared = true;
    if (copy.was_followed) copy.joint.engage();
  }
  for (Copy& copy : copies_) {
    const bool is_held = copy.is_known && tool_state_.held == copy.id && told_held_ == copy.id;
    copy.joint.step(now, kInputPeriod, {is_shared && copy.is_touched(), is_held, copy.other_holders});
  }
}

void LocalModel::drive_copies(const LocalModelInput& input, double period_s) noexcept {
  if (!playout_.has_started()) return;
  const Duration played = playout_.play_at(input.now.time_since_epoch());
  const Duration present = input.now.time_since_epoch() + input.newest->clock_offset;
  follow_touches(input.now.time_since_epoch(), period_s);
  for (Copy& copy : copies_) {
    if (!copy.is_known) continue;
    if (is_implicit(copy)) {
      drive_implicit(copy, played, period_s);
    } else {
      follow(copy, played, present, period_s);
    }
  }
}

/// Where our tool is and how it presses: friction there then turns neither the copy nor, at the other end, the body.
/// Both follow slowly, for what moves a joint's frame does work.
void LocalModel::follow_grip(Copy& copy, double period_s, bool is_begin) noexcept {
  const Pose X_BW = world_.body(copy.id).X.inverse();
  const bool is_at_once = is_begin || joint_share() <= 0;
  const double part = is_at_once ? 1.0 : std::min(1.0, period_s / kJointPlace_s);
  if (is_begin) copy.pressing_B = Vec3::Zero();
  copy.p_BJ += part * (X_BW * tool_state_.tool.X.p - copy.p_BJ);
  if (tool_state_.held == copy.id) {
    copy.pressing_B = Vec3::Zero();
    return;
  }
  const Vec3 normal_B = X_BW.q * world_.pressing_normal_W(tool_, copy.id);
  if (normal_B.norm() < 0.5) return;
  // An axis has no sign.
  const Vec3 like = normal_B.dot(copy.pressing_B) < 0 ? Vec3(-normal_B) : normal_B;
  copy.pressing_B = (copy.pressing_B + part * (like - copy.pressing_B)).normalized();
}

void LocalModel::drive_implicit(Copy& copy, Duration played, double period_s) noexcept {
  const auto index = static_cast<std::size_t>(&copy - copies_.data());
  const bool is_begin = std::exchange(copy.was_followed, false);
  ledger_.take(index);
  world_.keep_implicit(copy.id, 2 * period_s);
  const double share = copy.is_touched() ? copy.joint.share() : 0;
  follow_grip(copy, period_s, is_begin);
  const Vec3 pressing_W = world_.body(copy.id).X.q * copy.pressing_B;
  const physics::Joint joint = physics::DelayedJoint::joint(loop_delay_, slowest_loop_, pressing_W);
  // It begins where the copy is, which is ahead of what is played of the server's.
  if (is_begin) copy.offset = shift_between(copy.track.at(played), world_.body(copy.id));
  copy.offset = faded(copy.offset, period_s);
  world_.join_body(copy.id, shifted(copy.track.at(played), copy.offset), copy.p_BJ, joint, share,
                   1 - copy.joint.weight_on_copy());
  ledger_.joined(index);
  const Shift shift = copy.reconciler.step(period_s, to_seconds(loop_delay_), 1 - share);
  world_.shift_body(copy.id, pose_of(shift), {shift.v, shift.w});
  ledger_.corrected(index);
}

RigidState LocalModel::seen_at_present(Copy& copy, Duration played, Duration present, double period_s) noexcept {
  RigidState target = copy.track.at(played);
  const Duration ahead = std::clamp(present - played, Duration{0}, settings_.longest_extrapolation);
  const double speed = target.V.v.norm();
  double ahead_s = to_seconds(ahead);
  if (speed * ahead_s > settings_.farthest_extrapolation_m) ahead_s = settings_.farthest_extrapolation_m / speed;
  if (copy.is_felt_from_afar) return copy.smoothed.step(target.X, ahead_s, period_s);
  target.X = integrate(target.X, target.V, ahead_s);
  return target;
}

void LocalModel::follow(Copy& copy, Duration played, Duration present, double period_s) noexcept {
  if (!copy.was_followed) copy.smoothed.start_at(copy.track.at(played).X);
  const RigidState target = seen_at_present(copy, played, present, period_s);
  const auto index = static_cast<std::size_t>(&copy - copies_.data());
  if (!copy.was_followed) {
    ledger_.give_up(index);
    copy.offset = shift_between(target, world_.body(copy.id));
    copy.reconciler.reset();
    world_.join_body(copy.id, target, Vec3::Zero(), physics::Joint{}, 0);
    world_.keep_implicit(copy.id, 0);
    copy.was_followed = true;
  }
  copy.offset = faded(copy.offset, period_s);
  world_.set_body(copy.id, shifted(target, copy.offset));
  ledger_.follow(index);
}

void LocalModel::correct_tool(double period_s) noexcept {
  if (tool_state_.held.is_valid()) return;
  const Shift shift = tool_reconciler_.step(period_s, to_seconds(loop_delay_), 1 - joint_share());
  ledger_.take_tool();
  world_.shift_tool(tool_, pose_of(shift), {shift.v, shift.w});
  ledger_.corrected_tool();
}

void LocalModel::follow_soft_contact(const proto::ServerUpdate& update, bool is_new, double period_s) noexcept {
  const Pose X_WT = tool_state_.held.is_valid() ? world_.body(tool_state_.held).X : tool_state_.tool.X;
  // The contact is of what the tool holds, else of the tool: another thing's says nothing here.
  if (std::exchange(soft_of_, tool_state_.held) != tool_state_.held) soft_ = SoftFollower{};
  if (is_new && update.held_body == tool_state_.held) soft_.take(update.soft_contact, X_WT);
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
  touched_.clear();
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    const Copy& copy = copies_[i];
    const bool is_touched = copy.is_touched() || touches(copy.id);
    bodies[i] = {world_.body(copy.id), copy.reconciler.given(), !copy.was_followed && joint_share() <= 0, is_touched};
    if (is_touched && touched_.size() < touched_.capacity())
      touched_.push_back({copy.id, bodies[i].state, copy.p_BJ, copy.pressing_B});
  }
}

std::optional<Wrench> LocalModel::take_residual() noexcept {
  return std::exchange(residual_, std::nullopt);
}

bool LocalModel::take_jump() noexcept {
  return std::exchange(has_jumped_, false);
}

}  // namespace tandem::client

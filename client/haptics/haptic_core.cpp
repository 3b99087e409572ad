// See haptic_core.hpp. Data from the wire is checked again here: an invalid scene displays nothing, and coefficients
// are bounded before they affect the force.
#include "client/haptics/haptic_core.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "client/model/local_model.hpp"
#include "client/model/proxy_world.hpp"

namespace tandem::client {
namespace {

/// Age of a state: time since reception plus its age at the server when sent. A server that keeps sending the state of
/// a halted world is thus as stale as one that sends nothing.
Duration age_of(const ReceivedUpdate& newest, LocalTime now) noexcept {
  constexpr Duration kLongest = std::chrono::hours(1);
  const Duration kept_back = newest.update.sent - newest.update.stepped;
  return std::max(Duration{0}, now - newest.received) + std::clamp(kept_back, Duration{0}, kLongest);
}

// Minimum gap between two samples when a speed is computed. Otherwise a device that updates at 1 kHz would seem to jump
// when it is read twice in quick succession.
constexpr double kMinSpeedGap_s = 0.001;

/// ω of the blend from one rendering to the next: a difference of 18 N changes by less than 0.1 N in a millisecond.
constexpr double kRenderingBlend_per_s = 15;
/// Time in which the passivity controller fades in or out.
constexpr double kPassivityFade_s = 0.3;
/// Limit of the nudge when another user points, absolute and as a share of the device's force: just noticeable; ours.
constexpr double kMaxNudge_n = 0.3, kNudgeShare = 0.1;

bool is_clutch_down(const devices::DeviceSample& sample) {
  return (sample.buttons & kButtonClutch) != 0;
}

haptics::SafetySettings with_device_limits(haptics::SafetySettings settings, const devices::DeviceSpec& spec) {
  settings.slew_n_per_s = spec.slew_limit_n_per_s;
  settings.slew_n_m_per_s = spec.slew_limit_n_m_per_s;
  settings.speed_limit_m_per_s = spec.speed_limit_m_per_s;
  return settings;
}

bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

bool is_usable(const HapticScene& scene) {
  if (!SceneCoupling::is_usable(scene)) return false;
  const WorkspaceMapping& map = scene.workspace;
  return is_finite(map.X_WD) && std::abs(map.X_WD.q.norm() - 1) < 1e-3 && is_positive(map.position_scale) &&
         is_positive(map.force_scale);
}

}  // namespace

Rendering::Rendering() = default;
Rendering::~Rendering() = default;

HapticCore::HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes)
    : device_(device),
      reader_(device),
      writer_(device),
      mailboxes_(mailboxes),
      coupling_(settings.coupling_bounds),
      blend_(kRenderingBlend_per_s),
      has_passivity_(settings.stage.passivity),
      passivity_share_(settings.stage.passivity ? 1 : 0),
      watches_passivity_(settings.stage.passivity || settings.feeds_view),
      workspace_(device.spec(), settings.has_border),
      nudge_n_(std::min(kMaxNudge_n, kNudgeShare * device.spec().force_limit_n)),
      safety_(with_device_limits(settings.safety, device.spec())),
      device_path_(device.spec().position_step_m, device.spec().rotation_step_rad),
      view_(settings.feeds_view ? std::make_unique<ViewFeed>() : nullptr) {
  auto first = std::make_unique<Rendering>();
  first->stage = require_stage(settings.stage);
  offer(first);
  renderings_.enter(entered_ = offered_);
}

HapticCore::~HapticCore() = default;

bool HapticCore::offer(std::unique_ptr<Rendering>& rendering) {
  const std::uint32_t number = offered_.load(std::memory_order_relaxed) + 1;
  Stage* const stage = rendering->stage.get();
  if (!renderings_.offer(number, rendering)) return false;
  newest_stage_ = stage;
  offered_.store(number, std::memory_order_release);
  return true;
}

void HapticCore::tick(LocalTime now) noexcept {
  ++record_.tick.value;
  record_.at = now;
  advance_time(now);
  read_mailboxes();
  follow_start(now);
  record_.has_begun = began_at_ <= now;
  const devices::DeviceSample sample = reader_.read(now);
  record_.sample = sample;
  const double speed_m_per_s = handle_speed(sample);
  coupling_.advance(period_s_);
  move_handle(sample);
  record_.state_age = newest() != nullptr ? age_of(*newest(), now) : Duration{-1};
  run_stage(now);
  const Wrench controlled_on_hand_W = through_passivity_controller(stage_output_.wrench_on_hand_W);
  advance_nudge();
  requested_D_ = workspace_.mapping().device_wrench(controlled_on_hand_W) + Wrench{own_force_D(), Vec3::Zero()};
  write(now, through_safety(now, requested_D_, speed_m_per_s));
  request(controlled_on_hand_W);
  report_displayed();
  record_.is_clamped = writer_.was_clamped();
  last_sample_ = sample;
  record_stage();
  count();
  publish();
}

// The period is clamped, so that a stall does not count as one long tick.
void HapticCore::advance_time(LocalTime now) noexcept {
  constexpr double kUsual_s = 0.001, kShortest_s = 1e-5, kLongest_s = 0.01;
  const bool is_first = record_.tick.value == 1;
  period_s_ = is_first ? kUsual_s : std::clamp(to_seconds(now - ticked_at_), kShortest_s, kLongest_s);
  ticked_at_ = now;
}

bool HapticCore::write_zero(LocalTime now) noexcept {
  return write(now, Wrench{}) && !writer_.may_be_on();
}

// A command that the device refused is not felt: the previous one remains, and the next starts from it. A device that
// is not ready gets zero, whatever the stage computes.
bool HapticCore::write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept {
  const bool is_ready = record_.sample.state == devices::DeviceState::kReady;
  const bool is_taken = writer_.write(now, is_ready ? wrench_on_hand_D : Wrench{});
  if (!is_taken) {
    ++counters_.write_failures;
    safety_.rearm();
  }
  safety_.set_displayed(writer_.written());
  displayed_work_.hold(writer_.written());
  record_.displayed_on_hand_D = writer_.written();
  return is_taken;
}

// Larger of the reported speed and the speed between two poses, so that neither a lagging filter nor a jump of the
// position goes unnoticed.
double HapticCore::handle_speed(const devices::DeviceSample& sample) const noexcept {
  if (!sample.is_valid) return 0;
  const double reported_m_per_s = sample.V_DH.v.norm();
  if (!last_sample_.is_valid) return reported_m_per_s;
  const double gap_s = std::max(kMinSpeedGap_s, to_seconds(sample.taken - last_sample_.taken));
  return std::max(reported_m_per_s, (sample.X_DH.p - last_sample_.X_DH.p).norm() / gap_s);
}

// The inbox is polled before the scene. A state of an older connection, published just before the scene that replaces
// it, is then discarded with that connection. In the other order it could count as a state of the new scene.
// The rendering's number is read first: its scene was published before the rendering was offered, so it is available.
void HapticCore::read_mailboxes() noexcept {
  const std::uint32_t offered = offered_.load(std::memory_order_acquire);
  const bool has_new_state = mailboxes_.inbox.poll();
  if (has_new_state) has_state_ = true;
  if (mailboxes_.scene.poll()) enter_scene(mailboxes_.scene.front());
  if (offered != entered_) enter_rendering(offered);
  state_is_new_ = has_new_state && has_state_;
  if (!state_is_new_) return;
  receive_state(mailboxes_.inbox.front());
}

// Converts the server's start time to local time. The estimate is repeated until that time is reached, because the
// clock offset settles within the first second.
void HapticCore::follow_start(LocalTime now) noexcept {
  if (began_at_ <= now) return;
  if (scene_.hand_start.kind == HandStart::Kind::kAtOnce) {
    began_at_ = now;
    return;
  }
  const bool is_known = scene_.hand_start.kind == HandStart::Kind::kAt && newest() != nullptr;
  const Duration since_epoch = scene_.hand_start.at.time_since_epoch();
  began_at_ = is_known ? std::max(now, LocalTime(since_epoch - newest()->clock_offset)) : LocalTime::max();
  device_.begin_path_at(began_at_);
}

void HapticCore::enter_rendering(std::uint32_t number) noexcept {
  entered_ = number;
  // Must precede enter(), after which the io thread may free the previous rendering.
  const Rendering& before = rendering();
  const Rendering& next = *renderings_.offered(number);
  const bool goes_on = next.generation == before.generation && next.local_model && before.local_model;
  if (goes_on && scene_is_usable_) next.local_model->continue_from(*before.local_model, scene_);
  renderings_.enter(number);
  passivity_.forget_local_model();
  blend_.jump();
}

void HapticCore::enter_scene(const HapticScene& scene) noexcept {
  const bool is_new = scene.generation != scene_.generation;
  const bool is_shown_a_place = !is_new && scene.places_shown != scene_.places_shown;
  scene_ = scene;
  if (is_shown_a_place) nudge_towards(scene.shown_W);
  if (scene_.tool < scene_.coupling_bounds.size()) {
    scene_.coupling_bounds[scene_.tool] =
        haptics::coupling_bounds_in_world(coupling_.device_bounds(), scene_.workspace);
  }
  scene_is_usable_ = scene.generation != 0 && is_usable(scene);
  if (!is_new) return change_scene();
  if (scene_is_usable_) coupling_.start(scene);
  record_.scene_generation = scene.generation;
  record_.has_watched_body = false;
  has_state_ = false;
  rendering().stage->reset();
  blend_.reset();
  stage_output_ = {};
  passivity_.reset();
  clutch_.reset();
  workspace_.enter(scene_.workspace);
  outgoing_.forget_buttons();
  if (view_ != nullptr) view_->reset();
  safety_.rearm();
}

void HapticCore::nudge_towards(const Vec3& place_W) noexcept {
  if (!nudge_way_D_.isZero(0)) return;  // one nudge at a time; a running one is not interrupted
  const Vec3 way_W = place_W - record_.handle_W.X.p;
  nudged_s_ = 0;
  if (way_W.allFinite() && way_W.norm() > 1e-6)
    nudge_way_D_ = workspace_.mapping().X_WD.q.conjugate() * way_W.normalized();
}

/// Three force pulses in a fixed direction. They do not depend on the hand's motion, so they cannot oscillate with it.
void HapticCore::advance_nudge() noexcept {
  constexpr double kPeriod_s = 0.25, kPush_s = 0.08, kPushes = 3;
  nudge_D_.setZero();
  if (nudge_way_D_.isZero(0)) return;
  nudged_s_ += period_s_;
  const double into_s = std::fmod(nudged_s_, kPeriod_s);
  if (nudged_s_ >= kPushes * kPeriod_s || !is_displaying() || is_clutched()) {
    nudge_way_D_.setZero();
  } else if (into_s < kPush_s) {
    const double rise = std::sin(std::numbers::pi * into_s / kPush_s);
    nudge_D_ = nudge_n_ * rise * rise * nudge_way_D_;
  }
}

void HapticCore::change_scene() noexcept {
  workspace_.change(scene_.workspace);
  if (scene_is_usable_) coupling_.fade_to(scene_);
  // Nothing is felt, so no ramp is needed. A refused coupling must not be felt on the way to its replacement.
  if (!is_displaying()) coupling_.jump();
}

void HapticCore::receive_state(const ReceivedUpdate& received) noexcept {
  const proto::ServerUpdate& update = received.update;
  record_.tool_W = update.tool;
  record_.server_wrench_on_hand_W = update.wrench_on_hand_W;
  record_.newest_step = update.step;
  record_.server_tick_faults = update.tick_faults;
  record_.held_body = update.held_body;
  record_.field_energy_kj_per_mol = update.field_energy_kj_per_mol;
  note_watched_body(update);
  if (view_ != nullptr) view_->receive(update);
  passivity_.world_reported(update.energy_from_world_j, update.energy_into_world_j,
                            to_seconds(received.received - energy_reported_at_), stage_output_.is_local);
  energy_reported_at_ = received.received;
}

// Updates are thinned on the wire: if the body is missing from this one, its last state remains valid.
void HapticCore::note_watched_body(const proto::ServerUpdate& update) noexcept {
  const std::uint32_t watched = watched_.load(std::memory_order_relaxed);
  if (watched != watched_last_) record_.has_watched_body = false;
  watched_last_ = watched;
  if (watched == 0) return;
  for (const proto::BodyState& body : update.bodies) {
    if (body.id.value != watched) continue;
    record_.watched_body_W = body.state;
    record_.has_watched_body = true;
  }
}

void HapticCore::move_handle(const devices::DeviceSample& sample) noexcept {
  if (sample.is_valid) {
    X_DH_path_ = device_path_.follow(sample.X_DH, sample.V_DH, period_s_);
    displayed_work_.move_to(X_DH_path_);
  } else {
    device_path_.lose_pose();
    displayed_work_.lose_pose();
  }
  if (!scene_is_usable_ || !sample.is_valid) return workspace_.rest();
  move_base(sample);
  const WorkspaceMapping& map = workspace_.mapping();
  RigidState raw_W{map.world_pose(sample.X_DH), map.world_twist(sample.V_DH)};
  raw_W.V.v += workspace_.rate_W();
  raw_X_WH_ = map.world_pose(X_DH_path_);
  record_.handle_W = clutch_.apply(raw_W, is_clutched());
  X_WH_path_ = record_.handle_W.X;
  if (is_clutched()) return;
  X_WH_path_.p += raw_X_WH_.p - raw_W.X.p;
  X_WH_path_.q = (raw_X_WH_.q * raw_W.X.q.conjugate() * X_WH_path_.q).normalized();
}

// The base rests while the clutch is pressed. The tool is then frozen and no force is felt, so the mapping may change.
void HapticCore::move_base(const devices::DeviceSample& sample) noexcept {
  if (workspace_.is_changing() && safety_.is_quiet() && clutch_.is_pressed()) {
    workspace_.apply_change();
    // No force is felt: the coupling needs no ramp in the new mapping, and the handle's jump does no work.
    if (scene_is_usable_) coupling_.jump();
    passivity_.lose_hand();
  }
  if (!is_displaying() || is_clutched()) return workspace_.rest();
  workspace_.advance(sample.X_DH.p, shown_of_scene_D().f, period_s_);
}

/// The clutch also counts as pressed while a new mapping waits for the force to fade out.
bool HapticCore::is_clutched() const noexcept {
  return is_clutch_down(record_.sample) || workspace_.is_changing();
}

// After an invalid sample the last tool and wave are sent again. Without display neither is sent.
void HapticCore::run_stage(LocalTime now) noexcept {
  if (!is_displaying()) stage_output_ = {};
  stage_output_.wrench_on_hand_W = {};
  if (!is_displaying() || newest() == nullptr || !record_.sample.is_valid) {
    if (safety_.is_quiet()) blend_.reset();  // the force shown before has decayed
    return;
  }
  const StageInput input = stage_input(now);
  stage_output_ = rendering().stage->tick(input);
  if (stage_output_.is_local && input.local_model != nullptr) {
    shown_locally_.store(entered_, std::memory_order_relaxed);
  }
  blend_.advance(period_s_);
  stage_output_.wrench_on_hand_W = blend_.apply(stage_output_.wrench_on_hand_W);
}

StageInput HapticCore::stage_input(LocalTime now) const noexcept {
  StageInput input;
  input.now = now;
  input.tick = record_.tick;
  input.period_s = period_s_;
  input.handle = record_.handle_W;
  input.buttons = record_.sample.buttons;
  input.newest = newest();
  input.is_new = state_is_new_;
  input.age = record_.state_age;
  input.coupling = &coupling_.law();
  input.parameters = &coupling_.parameters();
  input.scene = &scene_;
  if (is_of_this_scene()) {
    input.local_model = rendering().local_model.get();
    input.proxy_world = rendering().proxy_world.get();
  }
  input.watched = BodyId{watched_last_};
  return input;
}

Wrench HapticCore::through_passivity_controller(const Wrench& stage_wrench_on_hand_W) noexcept {
  fade_passivity();
  if (!watches_passivity_) return stage_wrench_on_hand_W;
  if (!record_.sample.is_valid || !scene_is_usable_) {
    passivity_.lose_hand();
    return {};
  }
  passivity_.local_model_reported(stage_output_.energy_from_local_j);
  const Wrench controlled = passivity_.apply(raw_X_WH_, stage_wrench_on_hand_W, period_s_);
  if (passivity_share_ >= 1) return controlled;
  return stage_wrench_on_hand_W + (controlled - stage_wrench_on_hand_W) * passivity_share_;
}

void HapticCore::fade_passivity() noexcept {
  const bool is_on = has_passivity_.load(std::memory_order_relaxed);
  watches_passivity_ = watches_passivity_ || is_on;
  passivity_share_ = std::clamp(passivity_share_ + (is_on ? 1 : -1) * period_s_ / kPassivityFade_s, 0.0, 1.0);
}

Wrench HapticCore::through_safety(LocalTime now, const Wrench& controlled_on_hand_D,
                                  double handle_speed_m_per_s) noexcept {
  haptics::SafetyInput input;
  input.wrench = controlled_on_hand_D;
  input.state_age = record_.state_age;
  input.has_state = has_state_;
  input.is_displaying = is_displaying();
  input.is_clutched = record_.sample.is_valid && is_clutched();
  input.sample_is_valid = record_.sample.is_valid;
  input.handle_speed_m_per_s = handle_speed_m_per_s;
  if (record_.sample.is_valid) input.handle_v = record_.sample.V_DH.v;
  input.is_room_slow = has_state_ && (record_.server_tick_faults & kFaultRoomSlow) != 0;
  Wrench safe = safety_.apply(now, input);
  record_.safety_faults = safety_.faults();
  return safe;
}

// Work is summed along the handle pose that the tool follows: with the clutch pressed it is frozen, so no work is done.
// For a user who drives a tool without a displayed force, the server's wrench is used.
void HapticCore::request(const Wrench& controlled_on_hand_W) noexcept {
  // Far above any coupling; bounded work per tick keeps the sum within the wire's range.
  constexpr double kMax_n = 1000, kMax_n_m = 100;
  if (record_.sample.is_valid && is_driving()) {
    requested_work_.move_to(X_WH_path_);
  } else {
    requested_work_.lose_pose();
  }
  const Wrench& requested = is_displaying() ? controlled_on_hand_W : record_.server_wrench_on_hand_W;
  requested_work_.hold(is_finite(requested)
                           ? Wrench{clamped_to_length(requested.f, kMax_n), clamped_to_length(requested.t, kMax_n_m)}
                           : Wrench{});
}

void HapticCore::report_displayed() noexcept {
  if (!scene_is_usable_) return;
  const Wrench on_hand_W = workspace_.mapping().world_wrench(shown_of_scene_D());
  if (watches_passivity_) passivity_.set_displayed(on_hand_W);
  rendering().stage->set_displayed(on_hand_W);
}

/// Displayed wrench without the share of border and nudge.
Wrench HapticCore::shown_of_scene_D() const noexcept {
  const double requested_n = requested_D_.f.norm();
  if (requested_n <= 0 || own_force_D().isZero(0)) return writer_.written();
  const double share = std::min(1.0, writer_.written().f.norm() / requested_n);
  return writer_.written() - Wrench{share * own_force_D(), Vec3::Zero()};
}

void HapticCore::record_stage() noexcept {
  record_.stage_wrench_on_hand_D = workspace_.mapping().device_wrench(stage_output_.wrench_on_hand_W);
  record_.is_local = stage_output_.is_local;
  record_.local_tool_W = stage_output_.tool;
  record_.has_local_body = stage_output_.has_watched_body;
  record_.local_body_W = stage_output_.watched_body;
  record_.is_predicting = stage_output_.is_predicting;
  record_.stage_samples = stage_output_.samples;
  record_.passivity_gain = 1 + passivity_share_ * (passivity_.gain() - 1);
  record_.passivity_withheld_j = passivity_.withheld_j();
}

void HapticCore::count() noexcept {
  counters_.add(record_);
  counters_.energy_to_hand_j = displayed_work_.to_hand_j();
  counters_.energy_from_hand_j = displayed_work_.from_hand_j();
  counters_.passivity_withheld_j = passivity_.withheld_j() * workspace_.mapping().hand_joules_per_world_joule();
  counters_.passivity_limited_ticks = passivity_.limited_ticks();
  counters_.bad_energy_reports = passivity_.dropped_reports();
}

void HapticCore::publish() noexcept {
  outgoing_.write(mailboxes_.outbox.back(), record_, stage_output_, newest(), is_driving(), requested_work_);
  mailboxes_.outbox.publish();
  publish_view();
}

void HapticCore::publish_view() noexcept {
  if (view_ == nullptr || record_.tick.value % kViewEvery != 0) return;
  view_->write(record_, workspace_.mapping(), newest(), record_.is_local ? local_model() : nullptr);
}

}  // namespace tandem::client

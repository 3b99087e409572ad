// Data from the server is validated again on the haptic thread. An invalid scene displays no force (SceneInbox), and
// coefficients are bounded before they affect the force (SceneCoupling).
#include "client/haptics/haptic_core.hpp"
#include "common/base/tick_faults.hpp"

#include <algorithm>

namespace tandem::client {

HapticCore::HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes)
    : device_(device),
      mailboxes_(mailboxes),
      inbox_(mailboxes, settings.coupling_bounds),
      coupling_(settings.coupling_bounds),
      hand_(device, settings.has_border),
      output_(settings.safety, device),
      renderings_(require_stage(settings.stage)),
      passivity_(settings.stage.passivity, settings.feeds_view),
      nudge_(device.spec().force_limit_n),
      view_(settings.feeds_view ? std::make_unique<ViewFeed>() : nullptr) {}

HapticCore::~HapticCore() = default;

const LocalModel* HapticCore::local_model() const noexcept {
  const Rendering* const rendering = renderings_.of_scene(inbox_.scene().generation);
  return rendering != nullptr ? rendering->local_model.get() : nullptr;
}

void HapticCore::tick(LocalTime now) noexcept {
  ++record_.tick.value;
  record_.at = now;
  advance_time(now);
  read_mailboxes();
  follow_start(now);
  record_.has_begun = began_at_ <= now;
  hand_.read(now);
  coupling_.advance(period_s_);
  move_handle();
  record_.state_age = inbox_.state_age(now);
  run_stage(now);
  const Wrench controlled_on_hand_W = through_passivity_controller();
  display(now, controlled_on_hand_W);
  sum_requested_work(controlled_on_hand_W);
  report_displayed();
  record_output();
  count();
  publish();
}

// Measures the period since the last tick. The period is clamped, so that a stall of the thread is not integrated as
// one long tick.
void HapticCore::advance_time(LocalTime now) noexcept {
  constexpr double kUsual_s = 0.001, kShortest_s = 1e-5, kLongest_s = 0.01;
  const bool is_first = record_.tick.value == 1;
  period_s_ = is_first ? kUsual_s : std::clamp(to_seconds(now - ticked_at_), kShortest_s, kLongest_s);
  ticked_at_ = now;
}

bool HapticCore::write_zero(LocalTime now) noexcept {
  const bool is_zero = output_.write_zero(now);
  record_.displayed_on_hand_D = output_.displayed_D();
  counters_.write_failures = output_.write_failures();
  return is_zero;
}

// Reads the newest scene and server state. The number of the newest rendering must be read before the mailbox of the
// scene, for the reason given at RenderingSlot::newest().
void HapticCore::read_mailboxes() noexcept {
  const std::uint32_t newest_rendering = renderings_.newest();
  const SceneNews news = inbox_.poll();
  const HapticScene& scene = inbox_.scene();
  if (news.is_place_shown) {
    nudge_.begin(scene.shown_W - hand_.handle_W().X.p, hand_.mapping().X_WD.q.conjugate());
  }
  if (news.is_entered) enter_scene();
  if (news.is_changed) change_scene();
  const bool is_usable = inbox_.is_usable();
  if (renderings_.enter(newest_rendering, is_usable ? &scene : nullptr)) passivity_.forget_local_model();
  if (inbox_.has_new_state()) receive_state(*inbox_.newest());
}

void HapticCore::enter_scene() noexcept {
  const HapticScene& scene = inbox_.scene();
  if (inbox_.is_usable()) coupling_.start(scene);
  record_.scene_generation = scene.generation;
  record_.watched_body_W.reset();
  renderings_.reset();
  stage_output_ = {};
  passivity_.reset();
  hand_.enter(scene.workspace);
  outgoing_.forget_buttons();
  if (view_ != nullptr) view_->reset();
  output_.rearm();
}

void HapticCore::change_scene() noexcept {
  hand_.change(inbox_.scene().workspace);
  if (inbox_.is_usable()) coupling_.fade_to(inbox_.scene());
  // While no force is displayed, the coupling needs no ramp. A ramp would begin with the previous coupling, which may
  // have been refused as unstable.
  if (!inbox_.is_displaying()) coupling_.jump();
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
  passivity_.receive(received, stage_output_.is_local);
}

// Records the state of the watched body. An update need not contain every body, so the last received state is kept if
// the body is missing.
void HapticCore::note_watched_body(const proto::ServerUpdate& update) noexcept {
  const std::uint32_t watched = watched_.load(std::memory_order_relaxed);
  if (watched != watched_last_) record_.watched_body_W.reset();
  watched_last_ = watched;
  if (watched == 0) return;
  for (const proto::BodyState& body : update.bodies) {
    if (body.id.value == watched) record_.watched_body_W = body.state;
  }
}

// Converts the common start time of the room's hands from server time to local time. The conversion is repeated in each
// tick until the start, because the estimated clock offset becomes accurate only within the first second.
void HapticCore::follow_start(LocalTime now) noexcept {
  if (began_at_ <= now) return;
  const HandStart& start = inbox_.scene().hand_start;
  if (start.kind == HandStart::Kind::kAtOnce) {
    began_at_ = now;
    return;
  }
  const bool is_known = start.kind == HandStart::Kind::kAt && inbox_.newest() != nullptr;
  const Duration since_epoch = start.at.time_since_epoch();
  began_at_ = is_known ? std::max(now, LocalTime(since_epoch - inbox_.newest()->clock_offset)) : LocalTime::max();
  device_.begin_path_at(began_at_);
}

void HapticCore::move_handle() noexcept {
  const bool is_remapped = hand_.move({.period_s = period_s_,
                                       .has_scene = inbox_.is_usable(),
                                       .is_displaying = inbox_.is_displaying(),
                                       .is_quiet = output_.is_quiet(),
                                       .scene_on_hand_D = output_.displayed_of_scene_D().f});
  record_.sample = hand_.sample();
  record_.handle_W = hand_.handle_W();
  if (record_.sample.is_valid) {
    output_.move_to(hand_.path_D());
  } else {
    output_.lose_pose();
  }
  if (!is_remapped) return;
  // A mapping is applied only while no force is displayed. So the coupling needs no ramp, and the jump of the handle
  // does no work.
  coupling_.jump();
  passivity_.lose_hand();
}

// Ticks the stage. After an invalid sample the stage is not ticked, and the wave and mode of its last output are sent
// again. If no force may be displayed, wave and mode are reset.
void HapticCore::run_stage(LocalTime now) noexcept {
  if (!inbox_.is_displaying()) stage_output_ = {};
  stage_output_.wrench_on_hand_W = {};
  if (inbox_.is_displaying() && inbox_.newest() != nullptr && record_.sample.is_valid) {
    stage_output_ = renderings_.tick(stage_input(now));
  } else if (output_.is_quiet()) {
    renderings_.reset_blend();  // the force of the previous rendering has decayed to zero
  }
}

StageInput HapticCore::stage_input(LocalTime now) const noexcept {
  StageInput input;
  input.now = now;
  input.tick = record_.tick;
  input.period_s = period_s_;
  input.handle = record_.handle_W;
  input.buttons = record_.sample.buttons;
  input.newest = inbox_.newest();
  input.is_new = inbox_.has_new_state();
  input.age = record_.state_age;
  input.coupling = &coupling_.law();
  input.parameters = &coupling_.parameters();
  input.scene = &inbox_.scene();
  if (const Rendering* const rendering = renderings_.of_scene(inbox_.scene().generation)) {
    input.local_model = rendering->local_model.get();
    input.proxy_world = rendering->proxy_world.get();
  }
  input.watched = BodyId{watched_last_};
  return input;
}

Wrench HapticCore::through_passivity_controller() noexcept {
  const bool has_hand = record_.sample.is_valid && inbox_.is_usable();
  return passivity_.apply(has_hand ? &hand_.unclutched_path_W() : nullptr, stage_output_.wrench_on_hand_W,
                          stage_output_.energy_from_local_j, period_s_);
}

// Adds the client's own forces (border and nudge) to the scene's wrench and displays the sum. If the device is not
// ready, zero is written instead.
void HapticCore::display(LocalTime now, const Wrench& controlled_on_hand_W) noexcept {
  nudge_.advance(period_s_, inbox_.is_displaying() && !hand_.is_clutched());
  const Vec3 own_on_hand_D = hand_.wall_on_hand_D() + nudge_.on_hand_D();
  const bool is_ready = record_.sample.state == devices::DeviceState::kReady;
  output_.write(now, hand_.mapping().device_wrench(controlled_on_hand_W), own_on_hand_D, safety_conditions(), is_ready);
}

haptics::SafetyInput HapticCore::safety_conditions() const noexcept {
  const bool has_state = inbox_.newest() != nullptr;
  haptics::SafetyInput input;
  input.state_age = record_.state_age;
  input.has_state = has_state;
  input.is_displaying = inbox_.is_displaying();
  input.is_clutched = record_.sample.is_valid && hand_.is_clutched();
  input.sample_is_valid = record_.sample.is_valid;
  input.handle_speed_m_per_s = hand_.speed_m_per_s();
  if (record_.sample.is_valid) input.handle_v = record_.sample.V_DH.v;
  input.is_room_slow = has_state && (record_.server_tick_faults & kFaultRoomSlow) != 0;
  return input;
}

// Integrates the work that is reported to the server. It is the work of the requested wrench (before the safety chain)
// along the path of the handle with clutch. While the clutch is pressed, this path is frozen and adds no work. If the
// user drives a tool but no force is displayed, the server's wrench counts as the requested wrench.
void HapticCore::sum_requested_work(const Wrench& controlled_on_hand_W) noexcept {
  // Clamps of force and torque, far above those of any coupling. They bound the work of one tick, so that the sum stays
  // within the range of the protocol.
  constexpr double kMax_n = 1000, kMax_n_m = 100;
  if (record_.sample.is_valid && inbox_.is_driving()) {
    requested_work_.move_to(hand_.path_W());
  } else {
    requested_work_.lose_pose();
  }
  const Wrench& requested = inbox_.is_displaying() ? controlled_on_hand_W : record_.server_wrench_on_hand_W;
  requested_work_.hold(is_finite(requested)
                           ? Wrench{clamped_to_length(requested.f, kMax_n), clamped_to_length(requested.t, kMax_n_m)}
                           : Wrench{});
}

void HapticCore::report_displayed() noexcept {
  if (!inbox_.is_usable()) return;
  const Wrench on_hand_W = hand_.mapping().world_wrench(output_.displayed_of_scene_D());
  passivity_.set_displayed(on_hand_W);
  renderings_.set_displayed(on_hand_W);
}

void HapticCore::record_output() noexcept {
  record_.stage_wrench_on_hand_D = hand_.mapping().device_wrench(stage_output_.wrench_on_hand_W);
  record_.displayed_on_hand_D = output_.displayed_D();
  record_.is_local = stage_output_.is_local;
  record_.local_tool_W = stage_output_.tool;
  record_.local_body_W.reset();
  if (stage_output_.has_watched_body) record_.local_body_W = stage_output_.watched_body;
  record_.is_predicting = stage_output_.is_predicting;
  record_.stage_samples = stage_output_.samples;
  record_.passivity_gain = passivity_.gain();
  record_.passivity_withheld_j = passivity_.controller().withheld_j();
  record_.safety_faults = output_.faults();
  record_.is_clamped = output_.was_clamped();
}

void HapticCore::count() noexcept {
  const haptics::HandPassivityController& controller = passivity_.controller();
  counters_.add(record_);
  counters_.write_failures = output_.write_failures();
  counters_.energy_to_hand_j = output_.work().to_hand_j();
  counters_.energy_from_hand_j = output_.work().from_hand_j();
  counters_.passivity_withheld_j = controller.withheld_j() * hand_.mapping().hand_joules_per_world_joule();
  counters_.passivity_limited_ticks = controller.limited_ticks();
  counters_.bad_energy_reports = controller.dropped_reports();
}

void HapticCore::publish() noexcept {
  outgoing_.write(mailboxes_.outbox.back(), record_, stage_output_, inbox_.newest(), inbox_.is_driving(),
                  requested_work_);
  mailboxes_.outbox.publish();
  publish_view();
}

void HapticCore::publish_view() noexcept {
  if (view_ == nullptr || record_.tick.value % kViewEvery != 0) return;
  view_->write(record_, hand_.mapping(), inbox_.newest(), record_.is_local ? local_model() : nullptr);
}

}  // namespace tandem::client

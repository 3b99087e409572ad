// One haptic tick, from device sample to device command. The live loop (haptic_loop.hpp) and the lab call
// the same tick(); neither time nor thread is known here.
//
//   1 newest scene and server state              6 to the device base D
//   2 read the device once                       7 ramp and decay, slew limit, finite check  (common/haptics/safety.hpp)
//   3 workspace mapping, clutch                  8 clamp and write  (devices/device_writer.hpp)
//   4 stage: wrench on the hand in W             9 stage and passivity controller get what was displayed
//   5 passivity controller                      10 publish the client update
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "client/haptics/clutch.hpp"
#include "client/haptics/hand_workspace.hpp"
#include "client/haptics/mailboxes.hpp"
#include "client/haptics/outgoing_update.hpp"
#include "client/haptics/port_work.hpp"
#include "client/haptics/rendering.hpp"
#include "client/haptics/scene_coupling.hpp"
#include "client/haptics/stages/force_blend.hpp"
#include "client/haptics/stages/stage.hpp"
#include "client/haptics/tick_record.hpp"
#include "client/haptics/view.hpp"
#include "common/haptics/encoder_path.hpp"
#include "common/haptics/passivity/hand_passivity_controller.hpp"
#include "common/haptics/safety.hpp"
#include "common/realtime/handover.hpp"
#include "devices/device_reader.hpp"
#include "devices/device_writer.hpp"

namespace tandem::client {

struct HapticSettings {
  StageSettings stage{};
  bool feeds_view = false;           ///< for a window
  bool has_border = true;            ///< rate control and a soft wall where the device's workspace ends
  haptics::SafetySettings safety{};  ///< slew and speed limits are taken from the device's spec
  /// Numbers of the coupling that come from the wire are bounded by these (and by the device's own limits), in newtons
  /// and metres of the device; coupling_bounds() (devices/device_profile.hpp) gives those of a known device. Stiffness,
  /// as the steepest slope of the law's force, and damping are the largest that CHAI3D's device table allows a peer of
  /// 8 N; the rotational pair is ours, for a handle of 4e-4 kg·m² at 1 kHz. The shape of the curve is not bounded
  /// further than the wire does.
  haptics::CouplingParameters coupling_bounds{.stiffness_n_per_m = 3000.0,
                                              .damping_n_s_per_m = 20.0,
                                              .stiffness_n_m_per_rad = 3.0,
                                              .damping_n_m_s_per_rad = 0.05,
                                              .force_limit_n = 50.0,
                                              .torque_limit_n_m = 5.0,
                                              .saturation_softness = 1.0,
                                              .curve_sharpness = 10.0};
};

/// Owns the client's haptic path except thread and clock.
class HapticCore {
 public:
  /// Fails   std::invalid_argument for an unknown stage or predictor (names those that exist), an unusable impedance,
  ///         bad safety settings, or device limits that DeviceWriter refuses
  HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes);
  ~HapticCore();

  /// Thread  haptic: no allocation, lock, log or throw
  void tick(LocalTime now) noexcept;
  /// Ramps to zero from the next tick on; is_quiet() once nothing is displayed any more.
  void begin_shutdown() noexcept { safety_.begin_shutdown(); }
  bool is_quiet() const noexcept { return safety_.is_quiet(); }
  /// Gives the device zero, whatever came before: the last call before the device is closed. False as long as the device
  /// has not taken it.
  bool write_zero(LocalTime now) noexcept;
  /// Off-path work of the stage (Stage::service()), a millisecond of it at most.
  /// Thread  one at a time other than the haptic one
  void service() noexcept { newest_stage_->service(); }
  /// From the next tick on the hand is shown the scene in that way; the force goes over within 0.3 s, at most 18 N of
  /// difference by less than 0.1 N in a millisecond. Its local model goes on where the one before is, if both are of the
  /// same scene (LocalModel::go_on_from()). False leaves it with the caller, to be offered again later
  /// (Handover::offer()).
  /// Thread  io
  bool offer(std::unique_ptr<Rendering>& rendering);
  /// Number of the last rendering that offer() has taken.
  /// Thread  io
  std::uint32_t offered() const noexcept { return offered_.load(std::memory_order_relaxed); }
  /// Number of the newest rendering whose local model the hand was shown; 0: of none.
  /// Thread  any
  std::uint32_t shown_locally() const noexcept { return shown_locally_.load(std::memory_order_relaxed); }
  /// From the next tick on with or without the passivity controller, faded over 0.3 s.
  /// Thread  any
  void control_passivity(bool is_on) noexcept { wants_passivity_.store(is_on, std::memory_order_relaxed); }

  /// When the hand began to follow its path: the first tick, or the start of a room whose hands begin together. A time
  /// in the future until then; LocalTime::max(): not known yet. A hand that has begun does not begin again.
  /// Thread  haptic
  LocalTime began_at() const noexcept { return began_at_; }

  /// The last tick.
  const TickRecord& record() const { return record_; }
  const HapticCounters& counters() const { return counters_; }
  /// Of the scene in force; null: it has none.
  const LocalModel* local_model() const { return is_of_this_scene() ? rendering().local_model.get() : nullptr; }
  /// Null unless HapticSettings::feeds_view, and before the first. Valid until the next call.
  /// Thread  window
  const View* newest_view() noexcept { return view_ != nullptr ? view_->newest() : nullptr; }
  /// Body whose state goes into TickRecord::watched_body_W.
  /// Thread  any
  void watch(BodyId body) noexcept { watched_.store(body.value, std::memory_order_relaxed); }

 private:
  double handle_speed(const devices::DeviceSample& sample) const noexcept;
  void advance_time(LocalTime now) noexcept;
  void take_mail() noexcept;
  void follow_start(LocalTime now) noexcept;
  void enter_rendering(std::uint32_t number) noexcept;
  Rendering& rendering() const noexcept { return *renderings_.get(); }
  bool is_of_this_scene() const noexcept { return rendering().generation == scene_.generation; }
  void fade_passivity() noexcept;
  void enter_scene(const HapticScene& scene) noexcept;
  void change_scene() noexcept;
  void nudge_towards(const Vec3& place_W) noexcept;
  void advance_nudge() noexcept;
  /// Of border and nudge, which are a matter between device and hand.
  Vec3 own_force_D() const noexcept { return workspace_.wall_on_hand_D() + nudge_D_; }
  void take_state(const ReceivedUpdate& received) noexcept;
  void note_watched_body(const proto::ServerUpdate& update) noexcept;
  void move_handle(const devices::DeviceSample& sample) noexcept;
  void move_base(const devices::DeviceSample& sample) noexcept;
  void run_stage(LocalTime now) noexcept;
  StageInput stage_input(LocalTime now) const noexcept;
  Wrench through_passivity_controller(const Wrench& stage_wrench_on_hand_W) noexcept;
  Wrench through_safety(LocalTime now, const Wrench& controlled_on_hand_D, double handle_speed_m_per_s) noexcept;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  void request(const Wrench& controlled_on_hand_W) noexcept;
  void report_displayed() noexcept;
  bool is_clutched() const noexcept;
  Wrench shown_of_scene_D() const noexcept;
  void record_stage() noexcept;
  void count() noexcept;
  void publish() noexcept;
  void publish_view() noexcept;
  /// Handle and buttons are sent to the server.
  bool is_driving() const noexcept { return scene_is_usable_ && scene_.may_drive; }
  /// The hand feels the scene.
  bool is_displaying() const noexcept { return is_driving() && scene_.may_display; }
  /// Null: none in this scene yet.
  const ReceivedUpdate* newest() const noexcept { return has_state_ ? &mailboxes_.inbox.front() : nullptr; }

  devices::Device& device_;
  devices::DeviceReader reader_;
  devices::DeviceWriter writer_;
  ClientMailboxes& mailboxes_;
  SceneCoupling coupling_;
  realtime::Handover<Rendering> renderings_;  ///< numbered in the order in which they were offered
  std::atomic<std::uint32_t> offered_{0};     ///< the number of the last
  std::uint32_t entered_ = 0;                 ///< the number of that in use
  std::atomic<std::uint32_t> shown_locally_{0};
  Stage* newest_stage_ = nullptr;  ///< of the io thread: of the last that was offered
  ForceBlend blend_;               ///< from one rendering to the next
  StageOutput stage_output_;       ///< of the last tick at which a stage ran
  std::atomic<bool> wants_passivity_;
  double passivity_share_;  ///< of the wrench that the passivity controller gives
  /// It keeps its account, also while it is switched off: what is stored when it comes back was paid for before.
  bool watches_passivity_;
  haptics::HandPassivityController passivity_;
  HandWorkspace workspace_;
  Vec3 nudge_way_D_ = Vec3::Zero();  ///< zero: none
  Vec3 nudge_D_ = Vec3::Zero();      ///< of this tick [N]
  double nudge_n_;                   ///< at its strongest
  double nudged_s_ = 0;
  Clutch clutch_;
  haptics::SafetyChain safety_;
  HapticScene scene_;
  bool scene_is_usable_ = false;
  bool has_state_ = false;
  bool state_is_new_ = false;
  LocalTime began_at_ = LocalTime::max();
  LocalTime ticked_at_{};
  double period_s_ = 0.001;
  Pose X_DH_path_;  ///< of the hand: what it does work along, between the steps of its encoders
  Pose raw_X_WH_;   ///< that in the world, without clutch …
  Pose X_WH_path_;  ///< … and with it
  LocalTime energy_reported_at_{};
  std::atomic<std::uint32_t> watched_{0};
  std::uint32_t watched_last_ = 0;
  devices::DeviceSample last_sample_;  ///< of the last tick, when valid
  Wrench asked_D_;                     ///< of the device, by scene and border together
  haptics::EncoderPath device_path_;
  PortWork displayed_work_;  ///< device joules
  /// World joules, of the wrench after the passivity controller and before the safety stages: what ramp, slew limit and
  /// the device's own limit keep from the hand, its tool does in the world all the same, so the server has to count it.
  PortWork requested_work_;
  OutgoingUpdate outgoing_;
  std::unique_ptr<ViewFeed> view_;  ///< null: nobody looks
  TickRecord record_;
  HapticCounters counters_;
};

}  // namespace tandem::client

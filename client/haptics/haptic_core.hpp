// One haptic tick, from device sample to device command. The live loop (haptic_loop.hpp) and the lab call the same
// tick(); thread and time are supplied by the caller.
//
//   1 newest scene and server state              6 to the device base D
//   2 read the device once                       7 ramp and decay, slew limit, finite check  (common/haptics/safety.hpp)
//   3 workspace mapping, clutch                  8 clamp and write  (devices/device_writer.hpp)
//   4 stage: wrench on the hand in W             9 stage and passivity controller get the displayed wrench
//   5 passivity controller                      10 publish the client update
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/clutch.hpp"
#include "client/haptics/hand_workspace.hpp"
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
  /// Upper bounds of the coupling parameters that arrive over the wire, in newtons and metres of the device. The
  /// device's own limits apply as well; coupling_bounds() (devices/device_profile.hpp) gives the bounds of a known
  /// device. The stiffness (steepest slope of the law's force) and damping are the largest that CHAI3D's device table
  /// allows a peer of 8 N. The rotational pair is our choice, for a handle of 4e-4 kg·m² at 1 kHz. The shape of the
  /// curve has no bound beyond the wire's.
  haptics::CouplingParameters coupling_bounds{.stiffness_n_per_m = 3000.0,
                                              .damping_n_s_per_m = 20.0,
                                              .stiffness_n_m_per_rad = 3.0,
                                              .damping_n_m_s_per_rad = 0.05,
                                              .force_limit_n = 50.0,
                                              .torque_limit_n_m = 5.0,
                                              .saturation_softness = 1.0,
                                              .curve_sharpness = 10.0};
};

/// Owns the client's haptic path except its thread and clock.
class HapticCore {
 public:
  /// Fails   std::invalid_argument for an unknown stage or predictor (the message lists the existing ones), an unusable
  ///         impedance, bad safety settings, or device limits that DeviceWriter refuses
  HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes);
  ~HapticCore();

  /// Thread  haptic: no allocation, lock, log or throw
  void tick(LocalTime now) noexcept;
  /// Ramps the force to zero from the next tick on; is_quiet() is true once nothing is displayed.
  void begin_shutdown() noexcept { safety_.begin_shutdown(); }
  bool is_quiet() const noexcept { return safety_.is_quiet(); }
  /// Writes zero to the device: the last call before the device is closed. Returns false
  /// while the device has not accepted it.
  bool write_zero(LocalTime now) noexcept;
  /// Runs the off-path work of the stage (Stage::service()) for at most one millisecond.
  /// Thread  one at a time other than the haptic one
  void service() noexcept { newest_stage_->service(); }
  /// Offers a rendering that is used from the next tick on. The force blends over within 0.3 s; a difference of 18 N
  /// changes by less than 0.1 N in a millisecond. If both renderings are of the same scene, the new local model
  /// continues from the state of the previous one (LocalModel::continue_from()). Returns false if the rendering stays
  /// with the caller, and must be offered again later (Handover::offer()).
  /// Thread  io
  bool offer(std::unique_ptr<Rendering>& rendering);
  /// Number of the last rendering that offer() accepted.
  /// Thread  io
  std::uint32_t offered() const noexcept { return offered_.load(std::memory_order_relaxed); }
  /// Number of the newest rendering whose local model was displayed; 0: none.
  /// Thread  any
  std::uint32_t shown_locally() const noexcept { return shown_locally_.load(std::memory_order_relaxed); }
  /// Switches the passivity controller from the next tick on, faded over 0.3 s.
  /// Thread  any
  void control_passivity(bool is_on) noexcept { has_passivity_.store(is_on, std::memory_order_relaxed); }

  /// Time at which the hand begins to follow its path: the first tick, or the common start of the room's hands. It lies
  /// in the future until then; LocalTime::max() while unknown. Once in the past it does not change.
  /// Thread  haptic
  LocalTime began_at() const noexcept { return began_at_; }

  /// Record of the last tick.
  const TickRecord& record() const { return record_; }
  const HapticCounters& counters() const { return counters_; }
  /// Local model of the current scene; null: none.
  const LocalModel* local_model() const { return is_of_this_scene() ? rendering().local_model.get() : nullptr; }
  /// Newest view; null before the first one, and without HapticSettings::feeds_view. Valid until the next call.
  /// Thread  window
  const View* newest_view() noexcept { return view_ != nullptr ? view_->newest() : nullptr; }
  /// Selects the body whose state is recorded in TickRecord::watched_body_W.
  /// Thread  any
  void watch(BodyId body) noexcept { watched_.store(body.value, std::memory_order_relaxed); }

 private:
  double handle_speed(const devices::DeviceSample& sample) const noexcept;
  void advance_time(LocalTime now) noexcept;
  void read_mailboxes() noexcept;
  void follow_start(LocalTime now) noexcept;
  void enter_rendering(std::uint32_t number) noexcept;
  Rendering& rendering() const noexcept { return *renderings_.get(); }
  bool is_of_this_scene() const noexcept { return rendering().generation == scene_.generation; }
  void fade_passivity() noexcept;
  void enter_scene(const HapticScene& scene) noexcept;
  void change_scene() noexcept;
  void nudge_towards(const Vec3& place_W) noexcept;
  void advance_nudge() noexcept;
  /// Force of border and nudge, which the device adds on its own; it is no part of the scene.
  Vec3 own_force_D() const noexcept { return workspace_.wall_on_hand_D() + nudge_D_; }
  void receive_state(const ReceivedUpdate& received) noexcept;
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
  /// True if handle and buttons are sent to the server.
  bool is_driving() const noexcept { return scene_is_usable_ && scene_.may_drive; }
  /// True if the scene's force is displayed.
  bool is_displaying() const noexcept { return is_driving() && scene_.may_display; }
  /// Newest server state of this scene; null: none yet.
  const ReceivedUpdate* newest() const noexcept { return has_state_ ? &mailboxes_.inbox.front() : nullptr; }

  devices::Device& device_;
  devices::DeviceReader reader_;
  devices::DeviceWriter writer_;
  ClientMailboxes& mailboxes_;
  SceneCoupling coupling_;
  realtime::Handover<Rendering> renderings_;  ///< numbered in the order of their offers
  std::atomic<std::uint32_t> offered_{0};     ///< number of the last offered rendering
  std::uint32_t entered_ = 0;                 ///< number of the rendering in use
  std::atomic<std::uint32_t> shown_locally_{0};
  Stage* newest_stage_ = nullptr;  ///< io thread: stage of the last offered rendering
  ForceBlend blend_;               ///< fades from one rendering to the next
  StageOutput stage_output_;       ///< output of the last tick at which a stage ran
  std::atomic<bool> has_passivity_;
  double passivity_share_;  ///< weight of the passivity controller's wrench, 0 to 1
  /// Once on, the energy account is kept even while the controller is faded out, so that it is correct when it returns.
  bool watches_passivity_;
  haptics::HandPassivityController passivity_;
  HandWorkspace workspace_;
  Vec3 nudge_way_D_ = Vec3::Zero();  ///< direction of the nudge; zero: none
  Vec3 nudge_D_ = Vec3::Zero();      ///< force of the nudge at this tick [N]
  double nudge_n_;                   ///< amplitude of the nudge [N]
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
  Pose X_DH_path_;  ///< hand pose with encoder steps smoothed; work is summed along it
  Pose raw_X_WH_;   ///< that pose in the world, without clutch
  Pose X_WH_path_;  ///< that pose in the world, with clutch
  LocalTime energy_reported_at_{};
  std::atomic<std::uint32_t> watched_{0};
  std::uint32_t watched_last_ = 0;
  devices::DeviceSample last_sample_;  ///< sample of the last tick; may be invalid
  Wrench requested_D_;                 ///< wrench requested of the device: scene, border and nudge
  haptics::EncoderPath device_path_;
  PortWork displayed_work_;  ///< work of the displayed wrench [device J]
  /// Work in world joules of the wrench after the passivity controller and before the safety stages. Ramp, slew limit
  /// and device limit reduce only the displayed force. The tool still does the full work in the world, so the server
  /// counts it.
  PortWork requested_work_;
  OutgoingUpdate outgoing_;
  std::unique_ptr<ViewFeed> view_;  ///< null: no window
  TickRecord record_;
  HapticCounters counters_;
};

}  // namespace tandem::client

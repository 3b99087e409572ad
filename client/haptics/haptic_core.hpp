// One haptic tick, from device sample to device command. The live loop (haptic_loop.hpp) and the lab call the same
// function tick(). The caller supplies the thread and the time. A tick calls the parts below in this order; no part
// depends on the core:
//
//   1 read the newest scene and server state               SceneInbox
//   2 read the device once                                 HandInput
//   3 map to the workspace, apply the clutch: handle in W  HandInput
//   4 run the stage: wrench on the hand in W               RenderingSlot
//   5 limit the energy (passivity controller)              FadedPassivity
//   6 convert to the device base D, add border and nudge   HandInput, Nudge
//   7 ramp and decay, slew limit, finite check             ForceOutput  (common/haptics/safety.hpp)
//   8 clamp and write to the device                        ForceOutput  (devices/device_writer.hpp)
//   9 report the displayed wrench to stage and passivity controller
//  10 publish the client update                            OutgoingUpdate
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "client/exchange/mailboxes.hpp"
#include "client/haptics/faded_passivity.hpp"
#include "client/haptics/force_output.hpp"
#include "client/haptics/hand_input.hpp"
#include "client/haptics/nudge.hpp"
#include "client/haptics/outgoing_update.hpp"
#include "client/haptics/port_work.hpp"
#include "client/haptics/rendering_slot.hpp"
#include "client/haptics/scene_coupling.hpp"
#include "client/haptics/scene_inbox.hpp"
#include "client/haptics/stages/stage.hpp"
#include "client/haptics/tick_record.hpp"
#include "client/haptics/view.hpp"

namespace tandem::client {

struct HapticSettings {
  StageSettings stage{};
  bool feeds_view = false;           ///< true: data for a window are published (View)
  bool has_border = true;            ///< true: rate control and a soft wall at the border of the workspace
  haptics::SafetySettings safety{};  ///< slew and speed limits are replaced by those of the device
  /// Upper bounds of the coupling parameters received from the server, in newtons and metres of the device. The
  /// device's force limits apply in addition. These defaults are for an unknown device; coupling_bounds()
  /// (devices/device_profile.hpp) returns the bounds of a known device.
  /// * Stiffness (steepest slope of the law's force) and damping: the largest values in CHAI3D's device table for
  ///   devices of about 8 N.
  /// * Rotational values: our choice, for a handle of 4e-4 kg·m² at 1 kHz.
  /// * The last two parameters shape the force curve. Only the range in the protocol bounds them.
  haptics::CouplingParameters coupling_bounds{.stiffness_n_per_m = 3000.0,
                                              .damping_n_s_per_m = 20.0,
                                              .stiffness_n_m_per_rad = 3.0,
                                              .damping_n_m_s_per_rad = 0.05,
                                              .force_limit_n = 50.0,
                                              .torque_limit_n_m = 5.0,
                                              .saturation_softness = 1.0,
                                              .curve_sharpness = 10.0};
};

/// The client's haptic path, except its thread and clock.
class HapticCore {
 public:
  /// Fails   std::invalid_argument for an unknown stage or predictor (the message lists the existing ones), an unusable
  ///         impedance, bad safety settings, or device limits that DeviceWriter refuses
  HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes);
  ~HapticCore();

  /// Thread  haptic: no allocation, lock, log or throw
  void tick(LocalTime now) noexcept;
  /// Ramps the force to zero from the next tick on. is_quiet() returns true once no force is displayed.
  void begin_shutdown() noexcept { output_.begin_shutdown(); }
  bool is_quiet() const noexcept { return output_.is_quiet(); }
  /// Writes a zero wrench to the device. Must be the last call before the device is closed. Returns false if the device
  /// has not accepted the command.
  bool write_zero(LocalTime now) noexcept;
  /// Runs the stage's work outside the haptic tick (Stage::service()) for at most one millisecond.
  /// Thread  any but the haptic thread, one at a time
  void service() noexcept { renderings_.service(); }
  /// Offers a rendering (stage and model) to be used from the next tick on. The displayed force is blended within
  /// 0.3 s: even if the forces of both renderings differ by 18 N, it changes by less than 0.1 N in a millisecond. If
  /// both renderings are of the same scene, the new local model continues from the state of the previous one
  /// (LocalModel::continue_from()). Returns false if the rendering is not accepted. The caller then keeps the rendering
  /// and must offer it again later (Handover::offer()).
  /// Thread  io
  bool offer(std::unique_ptr<Rendering>& rendering) { return renderings_.offer(rendering); }
  /// Returns the number of the last rendering that offer() accepted.
  /// Thread  io
  std::uint32_t offered() const noexcept { return renderings_.offered(); }
  /// Returns the number of the newest rendering whose local model was displayed; 0 if there was none.
  /// Thread  any
  std::uint32_t shown_locally() const noexcept { return renderings_.shown_locally(); }
  /// Switches the passivity controller on or off. From the next tick on, it is faded over 0.3 s.
  /// Thread  any
  void control_passivity(bool is_on) noexcept { passivity_.switch_to(is_on); }

  /// Returns the time at which a simulated or recorded hand begins to follow its path. It is the time of the first
  /// tick, or the common start time of the room's hands if the server sets one. While the common start time is unknown,
  /// the result is LocalTime::max(). Once the result lies in the past, it does not change.
  /// Thread  haptic
  LocalTime began_at() const noexcept { return began_at_; }

  /// Returns the record of the last tick.
  const TickRecord& record() const { return record_; }
  const HapticCounters& counters() const { return counters_; }
  /// Returns the local model of the current scene; null if there is none.
  const LocalModel* local_model() const noexcept;
  /// Returns the newest view; null before the first view or without HapticSettings::feeds_view. Valid until the next
  /// call.
  /// Thread  window
  const View* newest_view() noexcept { return view_ != nullptr ? view_->newest() : nullptr; }
  /// Selects the body whose state is recorded in TickRecord::watched_body_W.
  /// Thread  any
  void watch(BodyId body) noexcept { watched_.store(body.value, std::memory_order_relaxed); }

 private:
  void advance_time(LocalTime now) noexcept;
  void read_mailboxes() noexcept;
  void enter_scene() noexcept;
  void change_scene() noexcept;
  void receive_state(const ReceivedUpdate& received) noexcept;
  void note_watched_body(const proto::ServerUpdate& update) noexcept;
  void follow_start(LocalTime now) noexcept;
  void move_handle() noexcept;
  void run_stage(LocalTime now) noexcept;
  StageInput stage_input(LocalTime now) const noexcept;
  Wrench through_passivity_controller() noexcept;
  void display(LocalTime now, const Wrench& controlled_on_hand_W) noexcept;
  haptics::SafetyInput safety_conditions() const noexcept;
  void sum_requested_work(const Wrench& controlled_on_hand_W) noexcept;
  void report_displayed() noexcept;
  void record_output() noexcept;
  void count() noexcept;
  void publish() noexcept;
  void publish_view() noexcept;

  devices::Device& device_;
  ClientMailboxes& mailboxes_;
  SceneInbox inbox_;
  SceneCoupling coupling_;
  HandInput hand_;
  ForceOutput output_;
  RenderingSlot renderings_;
  StageOutput stage_output_;  ///< output of the last tick at which a stage ran
  FadedPassivity passivity_;
  Nudge nudge_;
  /// Work of the wrench between passivity controller and safety chain, in world joules. It is sent to the server as the
  /// work that the tool does in the world. Ramp, slew limit and device limit do not reduce this work, because they
  /// reduce only the displayed force.
  PortWork requested_work_;
  OutgoingUpdate outgoing_;
  std::unique_ptr<ViewFeed> view_;  ///< publishes views for a window; null if HapticSettings::feeds_view is false
  LocalTime began_at_ = LocalTime::max();
  LocalTime ticked_at_{};
  double period_s_ = 0.001;
  std::atomic<std::uint32_t> watched_{0};
  std::uint32_t watched_last_ = 0;  ///< value of watched_ when the last state was received
  TickRecord record_;
  HapticCounters counters_;
};

}  // namespace tandem::client

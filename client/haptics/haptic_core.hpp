// One haptic tick, from device sample to device command. The live loop (haptic_loop.hpp) and the lab call
// the same tick(); neither time nor thread is known here.
//
//   1 read the device once                       6 to the device base D
//   2 newest scene and server state              7 ramp and decay, slew limit, finite check  (common/haptics/safety.hpp)
//   3 workspace mapping, clutch                  8 clamp and write  (devices/device_writer.hpp)
//   4 stage: wrench on the hand in W             9 stage and passivity controller get what was displayed
//   5 passivity controller                      10 publish the client update
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/haptics/clutch.hpp"
#include "client/haptics/mailboxes.hpp"
#include "client/haptics/stages/stage.hpp"
#include "common/haptics/coupling/coupling_ramp.hpp"
#include "common/haptics/passivity/hand_passivity_controller.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device_writer.hpp"

namespace tandem::client {

struct HapticSettings {
  StageSettings stage{};
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

/// What happened at one tick: for traces, metrics and tests.
struct TickRecord {
  Tick tick;
  LocalTime at{};
  devices::DeviceSample sample;
  RigidState handle_W;
  RigidState tool_W;              ///< newest of the server
  Wrench stage_wrench_on_hand_D;  ///< before passivity controller and safety
  Wrench displayed_on_hand_D;     ///< the last command that the device took
  Wrench server_wrench_on_hand_W;
  Duration state_age{0};  ///< since the newest server state arrived; negative: none yet
  Step newest_step;
  std::uint32_t server_tick_faults = 0;  ///< bits of TickFaults, of the newest state
  BodyId held_body;
  bool has_watched_body = false;    ///< the server has told of the watched body in this scene
  RigidState watched_body_W;        ///< newest of the server
  bool is_local = false;            ///< the stage has a tool of its own
  RigidState local_tool_W;          ///< that tool
  bool has_local_body = false;      ///< the stage has a copy of the watched body
  RigidState local_body_W;          ///< that copy
  bool is_predicting = false;       ///< the wrench has a predicted part
  double joint_share = 0;           ///< of a shared body's delayed joint
  double passivity_gain = 1;        ///< share of the stage's wrench that the passivity controller let through
  double passivity_withheld_j = 0;  ///< world joules, running sum
  std::uint32_t scene_generation = 0;
  haptics::SafetyFaults safety_faults = 0;
  bool is_clamped = false;
};

/// Running sums over ticks since construction.
struct HapticCounters {
  std::uint64_t ticks = 0;
  std::uint64_t invalid_samples = 0;
  std::uint64_t clamped_ticks = 0;
  std::uint64_t slew_limited_ticks = 0;
  std::uint64_t not_finite_ticks = 0;
  std::uint64_t silent_ticks = 0;          ///< state awaited, or older than the decay's start
  std::uint64_t not_displaying_ticks = 0;  ///< observer, no session, or a coupling that is refused
  std::uint64_t write_failures = 0;
  double force_square_sum = 0;   ///< displayed, N²
  double torque_square_sum = 0;  ///< displayed, (N·m)²
  double force_max_n = 0;
  double torque_max_n_m = 0;
  double energy_to_hand_j = 0;                ///< device joules, Σ of positive F_k·(x_{k+1} − x_k) + τ_k·Δθ
  double energy_from_hand_j = 0;              ///< device joules, Σ of the negative part, ≥ 0
  double passivity_withheld_j = 0;            ///< device joules that the passivity controller kept from the hand
  std::uint64_t passivity_limited_ticks = 0;  ///< at which it did
  std::uint64_t bad_energy_reports = 0;       ///< of the server: a sum that fell
  haptics::SafetyFaults faults_seen = 0;
};

/// Owns the client's haptic path except thread and clock.
class HapticCore {
 public:
  /// Fails   std::invalid_argument for an unknown stage or predictor (names those that exist), an unusable impedance,
  ///         bad safety settings, or device limits that DeviceWriter refuses
  HapticCore(const HapticSettings& settings, devices::Device& device, ClientMailboxes& mailboxes);

  /// Thread  haptic: no allocation, lock, log or throw
  void tick(LocalTime now) noexcept;
  /// Ramps to zero from the next tick on; is_quiet() once nothing is displayed any more.
  void begin_shutdown() noexcept { safety_.begin_shutdown(); }
  bool is_quiet() const noexcept { return safety_.is_quiet(); }
  /// Gives the device zero, whatever came before: the last call before the device is closed. False when the device
  /// did not take it.
  bool write_zero(LocalTime now) noexcept;
  /// Off-path work of the stage (Stage::service()), a millisecond of it at most.
  /// Thread  one at a time other than the haptic one
  void service() noexcept { stage_->service(); }

  /// The last tick.
  const TickRecord& record() const { return record_; }
  const HapticCounters& counters() const { return counters_; }
  /// Body whose state goes into TickRecord::watched_body_W.
  /// Thread  any
  void watch(BodyId body) noexcept { watched_.store(body.value, std::memory_order_relaxed); }

 private:
  void take_mail() noexcept;
  void enter_scene(const HapticScene& scene) noexcept;
  void jump_coupling() noexcept;
  void ramp_coupling(LocalTime now) noexcept;
  void take_state(const proto::ServerUpdate& update) noexcept;
  void note_watched_body(const proto::ServerUpdate& update) noexcept;
  devices::DeviceSample read_device(LocalTime now) noexcept;
  double handle_speed(const devices::DeviceSample& sample) const noexcept;
  void advance_time(LocalTime now) noexcept;
  void report_energy(const ReceivedUpdate& received) noexcept;
  void run_stage(LocalTime now) noexcept;
  StageInput stage_input(LocalTime now) const noexcept;
  Wrench through_passivity_controller(const Wrench& stage_wrench_on_hand_W) noexcept;
  Wrench through_safety(LocalTime now, const Wrench& controlled_on_hand_D, double handle_speed_m_per_s) noexcept;
  void tell_displayed() noexcept;
  void record_stage() noexcept;
  Duration round_trip() const noexcept;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept;
  std::uint32_t buttons_to_tell(LocalTime now) noexcept;
  void account_energy(const devices::DeviceSample& sample) noexcept;
  void add_requested_work(const Wrench& controlled_on_hand_W) noexcept;
  void count() noexcept;
  void publish(LocalTime now) noexcept;
  /// The server is told of the hand.
  bool is_driving() const noexcept { return scene_is_usable_ && scene_.may_drive; }
  /// The hand is told of the scene.
  bool is_displaying() const noexcept { return is_driving() && scene_.may_display; }

  devices::Device& device_;
  devices::DeviceWriter writer_;
  ClientMailboxes& mailboxes_;
  haptics::CouplingParameters coupling_bounds_;
  std::unique_ptr<Stage> stage_;
  StageOutput stage_output_;  ///< of the last tick at which it ran
  bool is_passivity_controlled_;
  haptics::HandPassivityController passivity_;
  std::vector<std::unique_ptr<haptics::CouplingLaw>> laws_;  ///< parallel to coupling_laws(): a scene may ask for any
  haptics::CouplingLaw* coupling_ = nullptr;                 ///< one of them, the scene's
  haptics::CouplingRamp ramp_{haptics::CouplingParameters{}};
  LocalTime ramped_at_{};
  Clutch clutch_;
  haptics::SafetyChain safety_;
  HapticScene scene_;
  bool scene_is_usable_ = false;
  bool has_state_ = false;
  bool state_is_new_ = false;
  LocalTime ticked_at_{};
  double period_s_ = 0.001;
  Pose raw_X_WH_;  ///< of the hand, without clutch: what it does work along
  LocalTime energy_reported_at_{};
  std::atomic<std::uint32_t> watched_{0};
  std::uint32_t watched_last_ = 0;
  devices::DeviceSample last_sample_;  ///< of the last tick, when valid
  std::uint32_t buttons_ = 0;          ///< of the last valid sample in this scene
  LocalTime buttons_seen_at_{};
  /// After the passivity controller, before the safety stages: what ramp, slew limit and the device's own limit keep from the hand,
  /// its tool does in the world all the same, so it counts as energy from the hand.
  Wrench requested_on_hand_W_;
  Pose requested_at_X_WH_;          ///< handle of the last tick
  bool is_requested_ = false;       ///< it was known then
  double requested_to_hand_j_ = 0;  ///< world joules
  double requested_from_hand_j_ = 0;
  TickRecord record_;
  HapticCounters counters_;
};

}  // namespace tandem::client

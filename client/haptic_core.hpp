// One haptic tick, from device sample to device command. The live loop (haptic_loop.hpp) and the lab call
// the same tick(); neither time nor thread is known here.
//
//   1 read the device once                       6 ramp and decay   (safety, common/safety.hpp)
//   2 newest scene and server state              7 slew limit
//   3 workspace mapping, clutch                  8 finite check
//   4 stage: wrench on the hand in W             9 clamp and write  (devices/device_writer.hpp)
//   5 to the device base D                      10 publish the client update
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/clutch.hpp"
#include "client/mailboxes.hpp"
#include "client/stage.hpp"
#include "common/ring.hpp"
#include "common/safety.hpp"
#include "devices/device_writer.hpp"

namespace tandem {

struct HapticSettings {
  std::string stage = "late-pose";
  SafetySettings safety;
};

/// What happened at one tick: for traces, metrics and tests.
struct TickRecord {
  Tick tick;
  LocalTime at{};
  DeviceSample sample;
  RigidState handle_W;
  RigidState tool_W;             ///< newest of the server
  Wrench stage_wrench_on_hand_D; ///< before the safety stages
  Wrench displayed_on_hand_D;    ///< what the device was given
  Wrench server_wrench_on_hand_W;
  Duration state_age{0};         ///< since the newest server state arrived; negative: none yet
  Step newest_step;
  BodyId held_body;
  RigidState first_body_W;       ///< scene body `watched`, newest of the server
  SafetyFaults safety_faults = 0;
  bool is_clamped = false;
};

/// Running sums over ticks since construction or reset_counters().
struct HapticCounters {
  std::uint64_t ticks = 0;
  std::uint64_t invalid_samples = 0;
  std::uint64_t clamped_ticks = 0;
  std::uint64_t slew_limited_ticks = 0;
  std::uint64_t not_finite_ticks = 0;
  std::uint64_t silent_ticks = 0;      ///< state older than the decay's start
  std::uint64_t write_failures = 0;
  double force_square_sum = 0;         ///< displayed, N²
  double torque_square_sum = 0;        ///< displayed, (N·m)²
  double force_max_n = 0;
  double torque_max_n_m = 0;
  double energy_to_hand_j = 0;         ///< device joules, Σ of positive F_k·(x_{k+1} − x_k)
  double energy_from_hand_j = 0;       ///< device joules, Σ of the negative part, ≥ 0
  SafetyFaults faults_seen = 0;
};

/// Owns the client's haptic path except thread and clock.
class HapticCore {
 public:
  /// Fails   std::invalid_argument for an unknown stage (names those that exist)
  HapticCore(const HapticSettings& settings, Device& device, ClientMailboxes& mailboxes);

  /// Thread  haptic: no allocation, lock, log or throw
  void tick(LocalTime now) noexcept;
  /// Ramps to zero from the next tick on; is_quiet() once nothing is displayed any more.
  void begin_shutdown() noexcept;
  bool is_quiet() const noexcept;

  /// The last tick.
  const TickRecord& record() const { return record_; }
  const HapticCounters& counters() const { return counters_; }
  /// Body whose state goes into TickRecord::first_body_W.
  void watch(BodyId body) { watched_ = body; }

 private:
  void take_mail(LocalTime now) noexcept;
  Wrench stage_wrench_on_hand_D(LocalTime now) noexcept;
  void account(const DeviceSample& sample) noexcept;
  void publish(LocalTime now) noexcept;

  Device& device_;
  DeviceWriter writer_;
  ClientMailboxes& mailboxes_;
  std::unique_ptr<Stage> stage_;
  std::unique_ptr<CouplingLaw> coupling_;
  Clutch clutch_;
  SafetyChain safety_;
  HapticScene scene_;
  bool has_state_ = false;
  BodyId watched_;
  Vec3 last_position_D_ = Vec3::Zero();
  Quat last_rotation_D_ = Quat::Identity();
  bool has_last_ = false;
  TickRecord record_;
  HapticCounters counters_;
};

}  // namespace tandem

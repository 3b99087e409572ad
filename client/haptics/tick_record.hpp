// What the haptic loop leaves behind: a record of the last tick, and sums over all of them.
#pragma once

#include <cstdint>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device.hpp"

namespace tandem::client {

/// What happened at one tick: for traces, metrics and tests.
struct TickRecord {
  Tick tick;
  LocalTime at{};
  bool has_begun = false;  ///< HapticCore::began_at() is not in the future
  devices::DeviceSample sample;
  RigidState handle_W;
  RigidState tool_W;              ///< newest of the server
  Wrench stage_wrench_on_hand_D;  ///< before passivity controller and safety
  Wrench displayed_on_hand_D;     ///< the last command that the device took
  Wrench server_wrench_on_hand_W;
  Duration state_age{0};  ///< since the newest server state arrived; negative: none yet
  Step newest_step;
  std::uint32_t server_tick_faults = 0;  ///< bits of TickFaults, of the newest state
  double field_energy_kj_per_mol = 0;    ///< of the newest state
  BodyId held_body;
  bool has_watched_body = false;    ///< the server has sent the watched body in this scene
  RigidState watched_body_W;        ///< newest of the server
  bool is_local = false;            ///< the stage has a tool of its own
  RigidState local_tool_W;          ///< that tool
  bool has_local_body = false;      ///< the stage has a copy of the watched body
  RigidState local_body_W;          ///< that copy
  bool is_predicting = false;       ///< the wrench has a predicted part
  std::uint64_t stage_samples = 0;  ///< StageOutput::samples
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
  double energy_to_hand_j = 0;                ///< device joules, of the displayed wrench (PortWork)
  double energy_from_hand_j = 0;              ///< likewise
  double passivity_withheld_j = 0;            ///< device joules that the passivity controller kept from the hand
  std::uint64_t passivity_limited_ticks = 0;  ///< at which it did
  std::uint64_t bad_energy_reports = 0;       ///< of the server: a sum that fell
  haptics::SafetyFaults faults_seen = 0;

  /// Everything that follows from the record of one tick; the others are set by whoever measures them.
  void add(const TickRecord& record) noexcept;
};

}  // namespace tandem::client

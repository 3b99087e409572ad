// Record of one haptic tick, and sums over all ticks.
#pragma once

#include <cstdint>
#include <optional>

#include "common/base/ids.hpp"
#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/haptics/safety.hpp"
#include "devices/device.hpp"

namespace tandem::client {

/// Record of one tick, for traces, metrics and tests.
struct TickRecord {
  Tick tick;
  LocalTime at{};
  bool has_begun = false;  ///< true: this tick is at or after HapticCore::began_at()
  devices::DeviceSample sample;
  RigidState handle_W;
  RigidState tool_W;              ///< tool in the newest server state
  Wrench stage_wrench_on_hand_D;  ///< wrench computed by the stage, before passivity controller and safety chain
  Wrench displayed_on_hand_D;     ///< last wrench that the device accepted
  Wrench server_wrench_on_hand_W;
  Duration state_age{0};  ///< age of the newest server state (SceneInbox::state_age()); negative if there is none
  Step newest_step;
  std::uint32_t server_tick_faults = 0;  ///< bits of TickFaults in the newest state
  double field_energy_kj_per_mol = 0;    ///< energy of the molecular field in the newest state
  BodyId held_body;
  /// Newest received state of the watched body; empty if no state of it was received in this scene.
  std::optional<RigidState> watched_body_W;
  bool is_local = false;    ///< true: the wrench comes from the local model, or from the ball of stage "god-object"
  RigidState local_tool_W;  ///< state of the local model's tool, or of the ball of stage "god-object"
  /// State of the watched body in the stage's local model; empty if the model does not contain the body.
  std::optional<RigidState> local_body_W;
  bool is_predicting = false;  ///< true: the wrench contains a predicted part
  /// Number of samples appended by a force stream in this tick (StageOutput::samples)
  std::uint64_t stage_samples = 0;
  double passivity_gain = 1;        ///< fraction of the stage's wrench that the passivity controller passed
  double passivity_withheld_j = 0;  ///< total energy withheld from the hand by the passivity controller [world J]
  std::uint32_t scene_generation = 0;
  haptics::SafetyFaults safety_faults = 0;
  bool is_clamped = false;
};

/// Running sums over the ticks since construction.
struct HapticCounters {
  std::uint64_t ticks = 0;
  std::uint64_t invalid_samples = 0;
  std::uint64_t clamped_ticks = 0;
  std::uint64_t slew_limited_ticks = 0;
  std::uint64_t not_finite_ticks = 0;
  std::uint64_t silent_ticks = 0;  ///< ticks without a server state, or with a state so old that the force decays
  /// Ticks whose force must not be displayed: observer, no session, or a refused coupling
  std::uint64_t not_displaying_ticks = 0;
  std::uint64_t write_failures = 0;
  double force_square_sum = 0;   ///< sum of the squared displayed forces [N²]
  double torque_square_sum = 0;  ///< sum of the squared displayed torques [(N·m)²]
  double force_max_n = 0;
  double torque_max_n_m = 0;
  double energy_to_hand_j = 0;                ///< work of the displayed wrench on the hand [device J] (PortWork)
  double energy_from_hand_j = 0;              ///< work of the hand on the device [device J], ≥ 0 (PortWork)
  double passivity_withheld_j = 0;            ///< energy withheld from the hand by the passivity controller [device J]
  std::uint64_t passivity_limited_ticks = 0;  ///< number of ticks at which the passivity controller reduced the wrench
  std::uint64_t bad_energy_reports = 0;       ///< number of server reports whose energy sum has decreased
  haptics::SafetyFaults faults_seen = 0;

  /// Adds the values that follow from the record of one tick. HapticCore sets the remaining values.
  void add(const TickRecord& record) noexcept;
};

}  // namespace tandem::client

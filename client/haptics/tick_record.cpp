#include "client/haptics/tick_record.hpp"

#include <algorithm>

namespace tandem::client {

void HapticCounters::add(const TickRecord& record) noexcept {
  const double force_n = record.displayed_on_hand_D.f.norm();
  const double torque_n_m = record.displayed_on_hand_D.t.norm();
  const haptics::SafetyFaults faults = record.safety_faults;
  ++ticks;
  invalid_samples += record.sample.is_valid ? 0 : 1;
  clamped_ticks += record.is_clamped ? 1 : 0;
  slew_limited_ticks += (faults & haptics::kSafetySlewed) != 0 ? 1 : 0;
  not_finite_ticks += is_finite(record.stage_wrench_on_hand_D) ? 0 : 1;
  silent_ticks += (faults & haptics::kSafetySilence) != 0 ? 1 : 0;
  not_displaying_ticks += (faults & haptics::kSafetyNotDisplaying) != 0 ? 1 : 0;
  force_square_sum += force_n * force_n;
  torque_square_sum += torque_n_m * torque_n_m;
  force_max_n = std::max(force_max_n, force_n);
  torque_max_n_m = std::max(torque_max_n_m, torque_n_m);
  faults_seen |= faults;
}

}  // namespace tandem::client

#include "lab/live_rows.hpp"

namespace tandem::lab {
namespace {

TickSample sample_of(const ExperimentUser& user, const LiveTick& tick, Duration time) {
  const TickRecord& record = tick.record;
  TickSample sample;
  sample.time = time;
  sample.phase = user.hand.phase_at(time);
  sample.hand_D = tick.hand_D;
  sample.hand_twist_D = tick.hand_twist_D;
  sample.intended_D = user.hand.pose_at(time).p;
  sample.handle_W = record.handle_W;
  sample.tool_W = record.tool_W.X;
  sample.stage_D = record.stage_wrench_on_hand_D;
  sample.asked_D = record.stage_wrench_on_hand_D * record.guard_gain;
  sample.displayed_D = record.displayed_on_hand_D;
  sample.server_wrench_W = record.server_wrench_on_hand_W;
  sample.state_age = record.state_age;
  sample.round_trip = tick.round_trip;
  sample.held_body = record.held_body;
  sample.view_W = record.has_local_body ? record.local_body_W.X.p : record.watched_body_W.X.p;
  sample.has_view = record.has_local_body || record.has_watched_body;
  sample.safety_faults = record.safety_faults;
  sample.server_tick_faults = record.server_tick_faults;
  sample.is_clamped = record.is_clamped;
  return sample;
}

}  // namespace

LiveRows live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start, Duration duration) {
  LiveRows result;
  const auto count = static_cast<std::size_t>(duration / kHapticPeriod);
  result.rows.reserve(count);
  std::size_t next = 0;
  for (std::size_t k = 0; k < count && !ticks.empty(); ++k) {
    const Duration begin = kHapticPeriod * static_cast<Duration::rep>(k);
    const std::size_t before = next;
    while (next < ticks.size() && ticks[next].record.at < start + begin + kHapticPeriod) ++next;
    const LiveTick& tick = ticks[next == 0 ? 0 : next - 1];
    const bool is_new = next > before;
    result.skipped += is_new ? 0 : 1;
    result.rows.push_back(sample_of(user, tick, is_new ? tick.record.at - start : begin + user.tick_phase));
  }
  return result;
}

}  // namespace tandem::lab

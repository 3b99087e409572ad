#include "lab/session/live_rows.hpp"

namespace tandem::lab {
namespace {

TickSample sample_of(const ExperimentUser& user, const LiveTick& tick, Duration time) {
  TickSample sample = lab::sample_of(tick.record);
  sample.time = time;
  sample.phase = user.hand.phase_at(time);
  sample.hand_D = tick.hand_D;
  sample.hand_twist_D = tick.hand_twist_D;
  sample.intended_D = user.hand.pose_at(time).p;
  sample.round_trip = tick.round_trip;
  return sample;
}

}  // namespace

std::vector<TickSample> live_rows(const ExperimentUser& user, const std::vector<LiveTick>& ticks, LocalTime start,
                                  Duration duration, std::uint64_t& skipped) {
  std::vector<TickSample> rows;
  skipped = 0;
  const auto count = static_cast<std::size_t>(duration / kHapticPeriod);
  rows.reserve(count);
  std::size_t next = 0;
  for (std::size_t k = 0; k < count && !ticks.empty(); ++k) {
    const Duration begin = kHapticPeriod * static_cast<Duration::rep>(k);
    const std::size_t before = next;
    while (next < ticks.size() && ticks[next].record.at < start + begin + kHapticPeriod) ++next;
    const LiveTick& tick = ticks[next == 0 ? 0 : next - 1];
    const bool is_new = next > before;
    skipped += is_new ? 0 : 1;
    rows.push_back(sample_of(user, tick, is_new ? tick.record.at - start : begin + user.tick_phase));
  }
  return rows;
}

}  // namespace tandem::lab

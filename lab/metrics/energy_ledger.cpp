#include "lab/metrics/energy_ledger.hpp"

#include <algorithm>
#include <deque>
#include <utility>

#include "common/base/work.hpp"

namespace tandem::lab {
namespace {

/// One user's port, advanced tick by tick.
class HandPort {
 public:
  explicit HandPort(const UserTrace& user) : user_(user) {}

  /// Takes in all periods that have ended by `time`.
  void advance_to(Duration time) {
    for (; next_ < user_.ticks.size() && user_.ticks[next_].time <= time; ++next_) {
      const TickSample& from = user_.ticks[next_ - 1];
      const Pose& to = user_.ticks[next_].hand_D;
      work_j_ += world_joules(held_work_j(from.displayed_D, from.hand_D, to));
      if (is_finite(from.asked_D)) {
        withheld_by_safety_j_ += world_joules(held_work_j(from.asked_D - from.displayed_D, from.hand_D, to));
      }
    }
  }
  double work_j() const { return work_j_; }
  /// M(t) − M(0), at the last tick so far.
  double model_change_j() const { return user_.ticks.empty() ? 0 : held_j(now()) - held_j(user_.ticks.front()); }
  double corrected_j() const {
    return user_.ticks.empty() ? 0 : now().model.corrected_j - user_.ticks.front().model.corrected_j;
  }
  double withheld_by_safety_j() const { return withheld_by_safety_j_; }
  double joints_j() const { return user_.ticks.empty() ? 0 : now().model.joints_j; }
  double field_work_j() const {
    return user_.ticks.empty() ? 0 : now().model.field_work_j - user_.ticks.front().model.field_work_j;
  }

 private:
  static double held_j(const TickSample& tick) { return tick.model.stored_j - tick.model.exchanged_j; }
  const TickSample& now() const { return user_.ticks[next_ - 1]; }
  double world_joules(double hand_joules) const { return hand_joules / user_.hand_joules_per_world_joule; }

  const UserTrace& user_;
  std::size_t next_ = 1;
  double work_j_ = 0;
  double withheld_by_safety_j_ = 0;
};

/// The greatest rise of a series within a window, given sample by sample.
class GreatestRise {
 public:
  explicit GreatestRise(Duration window) : window_(window) {}
  void add(Duration time, double value) {
    while (!rising_.empty() && rising_.back().second >= value) rising_.pop_back();
    rising_.emplace_back(time, value);
    while (rising_.front().first < time - window_) rising_.pop_front();
    greatest_ = std::max(greatest_, value - rising_.front().second);
  }
  double value() const { return greatest_; }

 private:
  Duration window_;
  std::deque<std::pair<Duration, double>> rising_;  ///< candidates for the least in the window: later ones are greater
  double greatest_ = 0;
};

}  // namespace

EnergyLedger energy_ledger(const SessionTrace& trace) {
  EnergyLedger ledger;
  std::vector<HandPort> ports(trace.users.begin(), trace.users.end());
  GreatestRise in_100_ms(from_seconds(0.1));
  GreatestRise in_1_s(from_seconds(1));
  for (const StoredEnergySample& sample : trace.stored) {
    double energy_j = sample.energy_j - trace.stored.front().energy_j;
    double by_field_j = 0;
    double joints_j = 0.5 * sample.joints_j;
    for (HandPort& port : ports) {
      port.advance_to(sample.time);
      by_field_j += port.field_work_j();
      joints_j += 0.5 * port.joints_j();
      energy_j += port.work_j() + port.withheld_by_safety_j() + port.model_change_j();
    }
    const double at_server_j = trace.stored.front().field_j - sample.field_j;
    energy_j -= std::max(0.0, at_server_j - by_field_j);
    energy_j += std::max(0.0, by_field_j - trace.field_depth_j);
    ledger.created_max_j = std::max(ledger.created_max_j, energy_j);
    in_100_ms.add(sample.time, energy_j + joints_j);
    in_1_s.add(sample.time, energy_j + joints_j);
    ledger.stored_change_j = sample.energy_j - trace.stored.front().energy_j;
  }
  ledger.created_in_100_ms_j = in_100_ms.value();
  ledger.created_in_1_s_j = in_1_s.value();
  for (const HandPort& port : ports) {
    ledger.hand_ports_j.push_back(port.work_j());
    ledger.withheld_by_safety_j += port.withheld_by_safety_j();
    ledger.stored_change_j += port.model_change_j();
    ledger.corrected_j += port.corrected_j();
  }
  return ledger;
}

}  // namespace tandem::lab

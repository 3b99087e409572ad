#include "lab/metrics/energy_ledger.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <utility>

#include "common/base/spatial.hpp"

namespace tandem::lab {
namespace {

/// Cumulative work on one user's hand at each tick.
struct HandWork {
  explicit HandWork(const UserTrace& user) {
    requested_j.reserve(user.ticks.size());
    const double scale = user.hand_joules_per_world_joule;
    for (std::size_t k = 1; k < user.ticks.size(); ++k) {
      const TickSample& from = user.ticks[k - 1];
      const Pose& to = user.ticks[k].hand_D;
      const double done_j = held_work_j(from.displayed_D, from.hand_D, to) / scale;
      const bool has_request = is_finite(from.requested_D);
      const double withheld_now_j =
          has_request ? held_work_j(from.requested_D - from.displayed_D, from.hand_D, to) / scale : 0.0;
      displayed_j += done_j;
      withheld_j += withheld_now_j;
      requested_j.push_back(requested_j.back() + done_j + withheld_now_j);
    }
  }

  std::vector<double> requested_j{0};
  double displayed_j = 0;
  double withheld_j = 0;
};

/// Contribution W + T of one user to E(t). It is valid from `time` until the user's next contribution.
struct Share {
  Duration time{0};
  std::size_t user = 0;
  double energy_j = 0;
};

void add_shares(const UserTrace& user, std::size_t index, const HandWork& work, std::vector<Share>& shares) {
  if (user.ticks.empty() || user.answered.empty()) return;
  const std::uint64_t first = user.ticks.front().tick.value;
  const auto sum_j = [&](const AnsweredInput& answer) {
    const std::uint64_t place = answer.tick.value - std::min(first, answer.tick.value);
    return work.requested_j[std::min<std::size_t>(place, user.ticks.size() - 1)] + answer.taken_j;
  };
  const double before_j = sum_j(user.answered.front());
  for (const AnsweredInput& answer : user.answered) shares.push_back({answer.time, index, sum_j(answer) - before_j});
}

/// Computes the maximum rise (latest value minus an earlier value) of a series within a sliding window. Values are
/// added one by one.
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
  std::deque<std::pair<Duration, double>> rising_;  ///< candidates for the minimum of the window, in ascending order
  double greatest_ = 0;
};

/// Returns the mean loop delay of a user, rounded to ticks. It is the sum of two means over the trial: the time from a
/// motion of the hand until the server's step that uses it, and the age of the newest state at a tick.
std::size_t loop_ticks(const UserTrace& user) {
  if (user.ticks.empty() || user.answered.empty()) return 0;
  double way_s = 0, age_s = 0;
  const std::uint64_t first = user.ticks.front().tick.value;
  for (const AnsweredInput& answer : user.answered) {
    const std::uint64_t place = answer.tick.value - std::min(first, answer.tick.value);
    way_s += to_seconds(answer.time - user.ticks[std::min<std::size_t>(place, user.ticks.size() - 1)].time);
  }
  for (const TickSample& tick : user.ticks) age_s += to_seconds(std::max(tick.state_age, Duration{0}));
  const double loop_s =
      way_s / static_cast<double>(user.answered.size()) + age_s / static_cast<double>(user.ticks.size());
  return static_cast<std::size_t>(std::lround(std::max(loop_s, 0.0) * 1e3));
}

}  // namespace

EnergyLedger energy_ledger(const SessionTrace& trace) {
  EnergyLedger ledger;
  std::vector<Share> shares;
  for (std::size_t i = 0; i < trace.users.size(); ++i) {
    const HandWork work(trace.users[i]);
    add_shares(trace.users[i], i, work, shares);
    ledger.hand_ports_j.push_back(work.displayed_j);
    ledger.withheld_by_safety_j += work.withheld_j;
  }
  std::stable_sort(shares.begin(), shares.end(), [](const Share& a, const Share& b) { return a.time < b.time; });
  GreatestRise in_100_ms(from_seconds(0.1));
  GreatestRise in_1_s(from_seconds(1));
  std::vector<double> now_j(trace.users.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    now_j[shares[i].user] = shares[i].energy_j;
    if (i + 1 < shares.size() && shares[i + 1].time == shares[i].time) continue;
    const double energy_j = std::accumulate(now_j.begin(), now_j.end(), 0.0);
    ledger.created_max_j = std::max(ledger.created_max_j, energy_j);
    in_100_ms.add(shares[i].time, energy_j);
    in_1_s.add(shares[i].time, energy_j);
  }
  ledger.created_in_100_ms_j = in_100_ms.value();
  ledger.created_in_1_s_j = in_1_s.value();
  return ledger;
}

double late_energy_j(const SessionTrace& truth, const SessionTrace& trial) {
  GreatestRise rise(Duration::max() / 2);
  std::vector<std::size_t> loops;
  for (const UserTrace& user : trial.users) loops.push_back(loop_ticks(user));
  double energy_j = 0;
  for (std::size_t j = 0;; ++j) {
    for (std::size_t i = 0; i < truth.users.size(); ++i) {
      const UserTrace& user = truth.users[i];
      if (j + 1 >= user.ticks.size()) return rise.value();
      const Wrench error_D = user.ticks[j - std::min(j, loops[i])].displayed_D - user.ticks[j].displayed_D;
      energy_j +=
          held_work_j(error_D, user.ticks[j].hand_D, user.ticks[j + 1].hand_D) / user.hand_joules_per_world_joule;
    }
    rise.add(truth.users.front().ticks[j].time, energy_j);
  }
}

}  // namespace tandem::lab

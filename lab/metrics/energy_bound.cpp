#include "lab/metrics/energy_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/work.hpp"

namespace tandem::lab {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Work on one user's hand from tick to tick, summed up to each.
struct HandWork {
  explicit HandWork(const UserTrace& user) {
    for (std::size_t k = 1; k < user.ticks.size(); ++k) {
      const TickSample& tick = user.ticks[k - 1];
      const Wrench& asked = is_finite(tick.asked_D) ? tick.asked_D : tick.displayed_D;
      const double hand_j = held_work_j(asked, tick.hand_D, user.ticks[k].hand_D);
      const double work_j = hand_j / user.hand_joules_per_world_joule;
      sum_j.push_back(sum_j.back() + work_j);
      size_j.push_back(size_j.back() + std::abs(work_j));
    }
  }
  std::vector<double> sum_j{0};
  std::vector<double> size_j{0};  ///< of the amounts without sign
};

bool has_bound(const UserTrace& user) {
  const std::string& stage = user.user.pipeline.stage;
  const bool is_over_network = !client::needs_local_model(stage) && !client::needs_proxy_world(stage);
  return is_over_network && !(user.user.pipeline.deadband > 0) && !user.answered.empty() &&
         std::none_of(user.ticks.begin(), user.ticks.end(), is_tool_energy_limited);
}

/// Of the coupling, when its handle jumps.
double jump_j(const UserTrace& user, const Pose& from, const Pose& to) {
  return 0.5 * (user.coupling_stiffness_n_per_m * (to.p - from.p).squaredNorm() +
                user.coupling_stiffness_n_m_per_rad * rotation_vector(to.q * from.q.conjugate()).squaredNorm());
}

double bound_of(const UserTrace& user) {
  const HandWork work(user);
  const std::uint64_t first = user.ticks.front().tick.value;
  const auto place_of = [&](const AnsweredInput& answer) {
    return std::min<std::size_t>(answer.tick.value - std::min(first, answer.tick.value), user.ticks.size() - 1);
  };
  double bound_j = 0;
  double in_flight_j = 0;
  std::size_t newest = 0;
  std::size_t before = 0;
  const auto see_in_flight = [&] {
    in_flight_j = std::max(in_flight_j, work.size_j[newest] - work.size_j[std::min(before, newest)]);
  };
  const AnsweredInput* answered = nullptr;
  for (const AnsweredInput& answer : user.answered) {
    while (newest + 1 < user.ticks.size() && user.ticks[newest + 1].time <= answer.time) ++newest;
    see_in_flight();
    const std::size_t place = place_of(answer);
    const Pose& from = user.ticks[before].handle_W.X;
    const Pose& to = user.ticks[place].handle_W.X;
    const Wrench answer_W = answered != nullptr ? answered->on_hand_W : Wrench{};
    bound_j += std::abs(work.sum_j[place] - work.sum_j[before] - held_work_j(answer_W, from, to));
    bound_j += jump_j(user, from, to);
    before = place;
    answered = &answer;
  }
  newest = user.ticks.size() - 1;
  see_in_flight();
  return bound_j + in_flight_j;
}

}  // namespace

double energy_created_bound_j(const SessionTrace& trace) {
  double bound_j = 0;
  for (const UserTrace& user : trace.users) {
    if (user.user.role != server::UserRole::kManipulator || user.ticks.empty()) continue;
    if (!has_bound(user)) return kNone;
    if (user.user.pipeline.stage != "wave") bound_j += bound_of(user);
  }
  return bound_j;
}

}  // namespace tandem::lab

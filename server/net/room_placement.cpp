#include "server/net/room_placement.hpp"

#include <algorithm>
#include <vector>

namespace tandem::server {
namespace {

// Loads, as fractions of a worker's time. kMaxToBear exceeds kMaxAcceptedLoad, so that a moved room is not moved again
// soon (hysteresis).
constexpr double kMaxAcceptedLoad = 0.7;  ///< load up to which a worker accepts a room
constexpr double kMaxToBear = 0.85;       ///< load above which a room is moved away
constexpr double kUneven = 0.25;          ///< difference between the loads of two workers above which a room is moved

using Places = std::span<std::optional<std::size_t>>;

std::vector<double> loads_of_workers(std::span<const double> loads, Places workers, std::size_t count) {
  std::vector<double> sums(count);
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (workers[i]) sums[*workers[i]] += loads[i];
  }
  return sums;
}

/// Returns the room with the largest load among the rooms of a worker whose own load is at most `most`; nothing if
/// there is no such room.
std::optional<std::size_t> largest_of(std::size_t worker, double most, std::span<const double> loads, Places workers) {
  std::optional<std::size_t> largest;
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (workers[i] == worker && loads[i] <= most && (!largest || loads[i] > loads[*largest])) largest = i;
  }
  return largest;
}

/// Returns the worker with the smallest load.
std::size_t idlest_of(const std::vector<double>& sums) {
  return static_cast<std::size_t>(std::ranges::min_element(sums) - sums.begin());
}

}  // namespace

void place_rooms(std::span<const double> loads, std::span<std::optional<std::size_t>> workers, std::size_t count) {
  for (std::size_t i = 0; i < loads.size(); ++i) {
    if (loads[i] == kSharesWithNobody) workers[i].reset();
  }
  std::vector<double> sums = loads_of_workers(loads, workers, count);
  for (std::size_t i = 0; i < loads.size(); ++i) {
    const std::size_t to = idlest_of(sums);
    if (workers[i] || sums[to] + loads[i] > kMaxAcceptedLoad) continue;
    workers[i] = to;
    sums[to] += loads[i];
  }
  const auto busiest = static_cast<std::size_t>(std::ranges::max_element(sums) - sums.begin());
  const std::size_t idlest = idlest_of(sums);
  const double difference = sums[busiest] - sums[idlest];
  const bool has_too_much = sums[busiest] > kMaxToBear;
  if (!has_too_much && difference < kUneven) return;
  // If no worker is overloaded, only the imbalance matters. A room with more than half of the load difference would
  // reverse the imbalance.
  const double room_left = kMaxAcceptedLoad - sums[idlest];
  const double most = has_too_much ? room_left : std::min(room_left, difference / 2);
  const auto one = largest_of(busiest, most, loads, workers);
  if (one && loads[*one] > 0) {
    workers[*one] = idlest;
  } else if (has_too_much) {
    workers[*largest_of(busiest, kSharesWithNobody, loads, workers)].reset();
  }
}

}  // namespace tandem::server

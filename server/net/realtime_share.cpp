#include "server/net/realtime_share.hpp"

#include <algorithm>
#include <vector>

namespace tandem::server {
namespace {

constexpr double kMaxToKeep = 0.93;
constexpr double kMaxToGain = 0.85;

}  // namespace

void share_realtime(const std::vector<double>& demands, std::vector<bool>& has_priority, std::size_t cores) {
  if (demands.empty()) return;
  std::vector<std::size_t> others;
  for (std::size_t user = 1; user < demands.size(); ++user) others.push_back(user);
  std::ranges::stable_sort(others, {}, [&demands](std::size_t user) { return demands[user]; });
  has_priority[0] = true;
  double sum = demands[0];
  for (const std::size_t user : others) {
    const double most = has_priority[user] ? kMaxToKeep : kMaxToGain;
    has_priority[user] = demands[user] <= most && sum + demands[user] <= most * static_cast<double>(cores);
    if (has_priority[user]) sum += demands[user];
  }
}

}  // namespace tandem::server

#include "server/net/realtime_share.hpp"

#include <algorithm>
#include <vector>

namespace tandem::server {
namespace {

constexpr double kMaxToKeep = 0.93;
constexpr double kMaxToGain = 0.85;

}  // namespace

void share_realtime(std::span<RealtimeUser> users, std::size_t cores) {
  if (users.empty()) return;
  std::vector<RealtimeUser*> others;
  for (RealtimeUser& user : users.subspan(1)) others.push_back(&user);
  std::ranges::stable_sort(others, {}, &RealtimeUser::demand);
  users[0].has_priority = true;
  double sum = users[0].demand;
  for (RealtimeUser* user : others) {
    const double most = user->has_priority ? kMaxToKeep : kMaxToGain;
    user->has_priority = user->demand <= most && sum + user->demand <= most * static_cast<double>(cores);
    if (user->has_priority) sum += user->demand;
  }
}

}  // namespace tandem::server

#include "client/haptics/port_work.hpp"

#include <algorithm>

#include "common/base/spatial.hpp"

namespace tandem::client {

void PortWork::move_to(const Pose& X) noexcept {
  if (has_pose_) {
    const double work_j = held_work_j(held_, X_, X);
    to_hand_j_ += std::max(0.0, work_j);
    from_hand_j_ += std::max(0.0, -work_j);
  }
  X_ = X;
  has_pose_ = true;
}

}  // namespace tandem::client

// What pulls things of the world to somewhere else: joints to the copies that clients step, and back.
#include <algorithm>
#include <cmath>

#include "common/physics/world_impl.hpp"

namespace tandem::physics {

void World::Impl::forget_copies(WorldTool& tool) noexcept {
  for (const Join& copy : tool.copies) {
    change_owner(bodies[copy.body], [](WorldBody& body) { --body.copies; });
  }
  tool.copies.clear();
  tool.copies_share = 0;
}

/// What copies elsewhere do not: 1 of a body that is not joined.
double World::Impl::weight_borne(std::size_t body) const {
  double there = bodies[body].join.weight_there;
  for (const WorldTool& tool : tools) {
    for (const Join& copy : tool.copies) there += copy.body == body ? copy.weight_there : 0;
  }
  return std::max(0.0, 1 - there);
}

void World::brake(std::size_t index, double n_s_per_m) {
  if (!std::isfinite(n_s_per_m) || n_s_per_m < 0) return;
  WorldTool& tool = impl_->tools[index];
  tool.brake_n_s_per_m = n_s_per_m;
  tool.hand.set_brake(n_s_per_m);
}

void World::join_copies(std::size_t index, const RigidState& tool_there, std::span<const CopyTarget> copies,
                        std::span<const Joint> joints, double share, std::span<const double> weights) {
  if (!is_finite(tool_there) || !std::isfinite(share)) return;
  WorldTool& tool = impl_->tools[index];
  // Taken before the old ones are let go, so that a body does not change its owner back and forth.
  const auto before = tool.copies;
  tool.copies.clear();
  tool.copies_share = copies.empty() && share < 1 ? 0 : std::clamp(share, 0.0, 1.0);
  tool.tool_there = tool_there;
  tool.tune_coupling();
  for (std::size_t i = 0; i < std::min({copies.size(), joints.size(), kMaxCopies}); ++i) {
    const CopyTarget& copy = copies[i];
    WorldBody* const body = impl_->body_of(copy.body);
    const bool is_usable_copy = body != nullptr && !body->rigid.is_static() && is_finite(copy.state) &&
                                is_finite(copy.p_BJ) && is_usable(joints[i]);
    if (!is_usable_copy || tool.copies_share <= 0) continue;
    impl_->change_owner(*body, [](WorldBody& changed) { ++changed.copies; });
    Join& join = tool.copies.emplace_back();
    join.body = copy.body.value - 1;
    join.share = tool.copies_share;
    join.law.set(joints[i], tool.copies_share);
    join.target = copy.state;
    join.p_BJ = copy.p_BJ;
    join.weight_there = i < weights.size() && weights[i] > 0 ? std::min(weights[i], 1.0) * tool.copies_share : 0;
  }
  for (const Join& old : before) {
    impl_->change_owner(impl_->bodies[old.body], [](WorldBody& changed) { --changed.copies; });
  }
}

void World::join_body(BodyId id, const RigidState& target, const Vec3& p_BJ, const Joint& joint, double share,
                      double weight_there) {
  WorldBody* const body = impl_->body_of(id);
  if (body == nullptr || body->rigid.is_static()) return;
  if (!is_finite(target) || !is_finite(p_BJ) || !is_usable(joint) || !std::isfinite(share + weight_there)) return;
  impl_->change_owner(*body, [&](WorldBody& changed) {
    changed.join.body = id.value - 1;
    changed.join.share = std::clamp(share, 0.0, 1.0);
    changed.join.law.set(joint, changed.join.share);
    changed.join.p_BJ = p_BJ;
    changed.join.weight_there = changed.join.share * std::clamp(weight_there, 0.0, 1.0);
    changed.join.target = target;
  });
}

}  // namespace tandem::physics

#include "common/contact/shell/plane_cache.hpp"

#include <algorithm>

#include "common/contact/field/oriented_box.hpp"
#include "common/contact/shell/search_settings.hpp"

namespace tandem::contact {

PlaneCache::PlaneCache() : answers_(kAnswers) {}

void PlaneCache::bind(const PointShell& shell, const DistanceField& field) noexcept {
  shell_ = &shell;
  field_ = &field;
  clear();
}

void PlaneCache::clear() noexcept {
  std::ranges::fill(answers_, CutNode{});
}

CutNode PlaneCache::planes_below(std::uint32_t index, double moved_m, const ShellMotion& motion) noexcept {
  const ShellNode& node = shell_->nodes[index];
  if (node.flat == ShellNode::kNotFlat || motion.solid_radius_m() < kSearch.min_solid_m) return {};
  CutNode& answer = answers_[index % kAnswers];
  if (answer.node == index && moved_m < answer.query_again_at_m) return answer;
  OrientedBox box_F = shell_->flat_nodes[node.flat].box_S().moved(motion.R_FP(), motion.p_FP());
  // The accumulated motion bounds the motion of points inside a ball around the solid. Points outside the ball may move
  // farther, in proportion to their distance from its centre. Nodes that extend beyond kSearch.sideways radii are
  // therefore not queried.
  const double reach_m = (box_F.centre - motion.solid_centre_F()).norm() + box_F.half_m.norm();
  if (reach_m > kSearch.sideways * motion.solid_radius_m()) return {};
  // When the step has reached its limit of queries, a node is queried only if it was above planes before. For other
  // nodes, the flag requests a later check of the part, which queries them.
  const bool was_above = answer.node == index && answer.planes != 0;
  if (!was_above && queries_ >= max_queries_) {
    has_open_question_ = true;
    return {};
  }
  box_F.half_m.array() += kSearch.sideways * kSearch.plane_motion_m;
  std::size_t queries = 0;
  const PlaneSet planes = largest_over(field_->planes(), field_->planes_over(box_F, queries), box_F);
  if (!was_above) queries_ += queries;
  const double good_for_m = planes != 0 ? kSearch.plane_motion_m : share_of(index) * kSearch.no_planes_m;
  answer = {.node = index, .query_again_at_m = rounded_down(moved_m + good_for_m), .planes = planes};
  return answer;
}

}  // namespace tandem::contact

// ContactPair::join(): removes or corrects contacts at places where a third shape covers the surface of one of the two
// shapes.
#include <algorithm>

#include "common/contact/contact_pair.hpp"

namespace tandem::contact {
namespace {

// A contact is dropped if less than this fraction of its area remains.
constexpr double kMinKeptShare = 1e-3;

/// Returns the mean normal of the points that a contact represents, or `otherwise_W` for a contact without points.
Vec3 mean_normal_of(std::span<const ShellPoint> points, const Pose& X_WS, const Vec3& otherwise_W) {
  Vec3 sum = Vec3::Zero();
  for (const ShellPoint& point : points) sum += point.normal_S.cast<double>();
  return sum.squaredNorm() > 0 ? Vec3(X_WS.q * sum.normalized()) : otherwise_W;
}

}  // namespace

void ContactPair::join(const Pose& X_WA, const Pose& X_WB, std::span<PlacedShape> beside_a,
                       std::span<PlacedShape> beside_b) noexcept {
  if (!is_bound() || now_.empty()) return;
  const ShapeUnion union_a({a_, X_WA}, beside_a.first(keep_near(beside_a, now_)));
  const ShapeUnion union_b({b_, X_WB}, beside_b.first(keep_near(beside_b, now_)));
  if (!union_a.has_others() && !union_b.has_others()) return;
  std::size_t kept = 0, kept_before_other = 0;
  for (std::size_t i = 0; i < now_.size(); ++i) {
    ContactPoint contact = now_[i];
    const bool is_ball = (contact.id & ContactPoint::kClosedForm) != 0;
    const bool is_of_a = is_ball ? closed_form_.is_ball_a() : this->is_of_a(contact);
    const ShapeUnion& own = is_of_a ? union_a : union_b;
    const ShapeUnion& other = is_of_a ? union_b : union_a;
    // Direction out of the shape in whose field the depth was sampled.
    const Vec3 out_W = is_of_a ? contact.normal_W : Vec3(-contact.normal_W);
    const double area_m2 = contact.area_m2;
    if (own.has_others()) {
      const Vec3 normal_W = mean_normal_of(points_of(contact), is_of_a ? X_WA : X_WB, -out_W);
      contact.area_m2 *= 1 - own.covered_share(contact.p_W, normal_W);
    }
    if (other.has_others()) other.correct_depth(contact, out_W);
    if (!(contact.area_m2 > kMinKeptShare * area_m2)) continue;
    const bool has_turned = contact.normal_W != now_[i].normal_W;
    now_[kept++] = contact;
    if (has_turned && !is_ball) carry_bristle_again(kept - 1, i < first_of_other_);
    if (i < first_of_other_) kept_before_other = kept;
  }
  now_.resize(kept);
  first_of_other_ = kept_before_other;
}

// Transfers the bristle (friction state) of the previous step again to a contact whose normal was changed. find() has
// removed the bristle's component along the old normal, but that component may be tangential to the new normal.
void ContactPair::carry_bristle_again(std::size_t index, bool is_first_direction) noexcept {
  const std::size_t begin = is_first_direction ? 0 : first_of_other_before_;
  const std::size_t end = is_first_direction ? first_of_other_before_ : before_.size();
  const std::uint32_t id = now_[index].id;
  const auto ends_first = [id](const ContactPoint& old) { return old.id + old.count <= id; };
  const auto before = std::span(before_).subspan(begin, end - begin);
  const auto first = std::ranges::partition_point(before, ends_first) - before.begin();
  carry_bristles(index, index + 1, begin + static_cast<std::size_t>(first), end, turn_of_b_);
}

}  // namespace tandem::contact

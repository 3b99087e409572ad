#include "common/contact/union/shape_union.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "common/contact/contact_point.hpp"
#include "common/contact/field/oriented_box.hpp"

namespace tandem::contact {
namespace {

// Width of the transition between covered and free surface [m]. It is kBlend_m, or kBlendErrors times the sum of both
// fields' errors if that is larger.
constexpr double kBlend_m = 2e-5, kBlendErrors = 2;
// Distances from a covered face, towards the inside, at which the field is sampled to find another, nearer face. They
// are in the order of the search. Exact fields begin with the shortest distance. Grids begin with a medium one, because
// they round off edges by up to the size of a cell.
constexpr std::array<double, 5> kExactWays_m = {6e-5, 1.2e-4, 2.5e-4, 5e-4, 1e-3};
constexpr std::array<double, 5> kGridWays_m = {5e-4, 2.5e-4, 1e-3, 1.2e-4, 6e-5};
// Maximum number of iterations of the search for a free face. Each iteration starts below the covered face that the
// previous one has found.
constexpr int kMaxTurns = 4;
// If a contact is inside several shapes, its area is divided among them in proportion to its depth in each. A depth
// above this value counts as this value [m].
constexpr double kShared_m = 1e-5;

/// Returns 0 below `low`, 1 above `high`, linear in between.
double ramp(double value, double low, double high) {
  return std::clamp((value - low) / (high - low), 0.0, 1.0);
}

/// Distance of a point to a shape, with a unit gradient in W.
struct ShapeSample {
  double distance_m = 0;
  Vec3 gradient_W = Vec3::UnitZ();
  double error_m = 0;
};

/// Samples a shape. If a sampled field has planes at the point, they are used instead, because samples round off edges.
ShapeSample sample_shape(const PlacedShape& placed, const Vec3& p_W) {
  const DistanceField& field = *placed.shape->field;
  const Vec3 p_S = placed.X_WS.inverse() * p_W;
  if (field.error_m() > 0 && !field.planes().empty()) {
    const FieldPlane* largest = nullptr;
    for (PlaneSet rest = field.planes_at(p_S); rest != 0; rest &= rest - 1) {
      const FieldPlane& plane = field.planes()[static_cast<std::size_t>(std::countr_zero(rest))];
      if (largest == nullptr || plane.distance_m(p_S) > largest->distance_m(p_S)) largest = &plane;
    }
    if (largest != nullptr) return {largest->distance_m(p_S), placed.X_WS.q * largest->normal, 0};
  }
  const DistanceSample s = field.sample(p_S);
  return {s.distance_m, placed.X_WS.q * s.gradient.normalized(), field.error_m()};
}

double distance_m(const PlacedShape& placed, const Vec3& p_W) {
  return sample_shape(placed, p_W).distance_m;
}

double blend_m(const PlacedShape& a, const PlacedShape& b, const Vec3& p_W) {
  return std::max(kBlend_m, kBlendErrors * (sample_shape(a, p_W).error_m + sample_shape(b, p_W).error_m));
}

/// Returns the degree, 0 to 1, to which `other` covers the surface point q of another shape. `out_W` is the normal at
/// q.
double exit_cover(const PlacedShape& other, const Vec3& q_W, const Vec3& out_W, double blend) {
  const double at = distance_m(other, q_W) / blend;
  if (at >= 1) return 0;
  const double beyond = distance_m(other, q_W + blend * out_W) / blend;
  return std::max(ramp(at - beyond, 0.1, 0.4) * ramp(1 - at, 0, 0.5), ramp(-at, 0.1, 0.5));
}

}  // namespace

/// The shape that covers a surface point to the highest degree, and this degree (0 to 1).
struct ShapeUnion::Cover {
  double share = 0;
  const PlacedShape* by = nullptr;
};

std::size_t keep_near(std::span<PlacedShape> shapes, std::span<const ContactPoint> contacts) noexcept {
  if (contacts.empty() || shapes.empty()) return 0;
  Vec3 low = contacts.front().p_W, high = low;
  double reach_m = 0;
  for (const ContactPoint& contact : contacts) {
    low = low.cwiseMin(contact.p_W);
    high = high.cwiseMax(contact.p_W);
    reach_m = std::max(reach_m, std::abs(contact.depth_m));
  }
  const Vec3 middle = (low + high) / 2;
  const double radius_m = (high - low).norm() / 2 + reach_m;
  std::size_t kept = 0;
  for (const PlacedShape& placed : shapes) {
    const double blend = kBlend_m + 2 * kBlendErrors * placed.shape->field->error_m();
    if (distance_m(placed, middle) <= radius_m + blend) shapes[kept++] = placed;
  }
  return kept;
}

ShapeUnion::Cover ShapeUnion::cover_of(const PlacedShape& leaving, const Vec3& q_W, const Vec3& out_W) const noexcept {
  Cover most;
  const auto add_cover = [&](const PlacedShape& other) {
    if (other.shape == leaving.shape && is_same(other.X_WS, leaving.X_WS)) return;
    const double share = exit_cover(other, q_W, out_W, blend_m(leaving, other, q_W));
    if (share > most.share) most = {share, &other};
  };
  add_cover(own_);
  for (const PlacedShape& other : others_) add_cover(other);
  return most;
}

// Returns the displacement that moves p out of a shape through a face that no other shape covers; nothing if no such
// face is found. Near p, a covered face is the nearest one, so the field is sampled farther inside. The depth below a
// flat face is linear in the position, so the depth of p follows from that sample.
std::optional<Vec3> ShapeUnion::way_out(const PlacedShape& shape, const Vec3& p_W, Vec3 inward_W) const noexcept {
  const auto& ways_m = shape.shape->field->error_m() > 0 ? kGridWays_m : kExactWays_m;
  Vec3 from_W = p_W;
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    std::optional<Vec3> covered_W;
    Vec3 covered_from_W = from_W;
    double deepest_m = 0, deepest_way_m = 0;
    for (const double way_m : ways_m) {
      const Vec3 at_W = from_W + way_m * inward_W;
      const ShapeSample inside = sample_shape(shape, at_W);
      if (inside.distance_m >= 0) continue;
      const double depth_m = -inside.distance_m + (at_W - p_W).dot(inside.gradient_W);
      if (depth_m < 0) continue;
      Vec3 out_W = depth_m * inside.gradient_W;
      const ShapeSample beyond = sample_shape(shape, p_W + out_W);
      if (beyond.distance_m > 0) out_W -= beyond.distance_m * beyond.gradient_W;
      // The face is free if two of its points are uncovered: the surface point nearest to the sample, and the point to
      // which p would move. At a corner of several covered faces, only one of them may be covered.
      const Vec3 foot_W = at_W - inside.distance_m * inside.gradient_W;
      if (cover_of(shape, foot_W, inside.gradient_W).share < 0.5 &&
          cover_of(shape, p_W + out_W, inside.gradient_W).share < 0.5)
        return out_W;
      // This exit is covered by another shape. The next iteration starts from the sample that is deepest below the
      // covered face.
      if (covered_W && (-inside.distance_m < deepest_m || (-inside.distance_m == deepest_m && way_m < deepest_way_m)))
        continue;
      deepest_m = -inside.distance_m;
      deepest_way_m = way_m;
      covered_W = inside.gradient_W;
      covered_from_W = at_W;
    }
    if (!covered_W) return std::nullopt;
    from_W = covered_from_W;
    inward_W = -*covered_W;
  }
  return std::nullopt;
}

void ShapeUnion::correct_depth(ContactPoint& contact, const Vec3& out_W) const noexcept {
  if (!(contact.depth_m > 0)) return correct_gap(contact, out_W);
  const Vec3 p_W = contact.p_W, way_W = contact.depth_m * out_W;
  const Cover cover = cover_of(own_, p_W + way_W, out_W);
  if (cover.share > 0) {
    const ShapeSample to_cover = sample_shape(*cover.by, p_W);
    const Vec3 inward_W = to_cover.distance_m > 0 ? to_cover.gradient_W : Vec3(-out_W);
    std::optional<Vec3> shortest_W = way_out(own_, p_W, inward_W);
    if (const std::optional<Vec3> beyond_W = way_out(*cover.by, p_W + way_W, out_W)) {
      const Vec3 through_W = way_W + *beyond_W;
      if (!shortest_W || through_W.squaredNorm() < shortest_W->squaredNorm()) shortest_W = through_W;
    }
    if (shortest_W) {
      const Vec3 mixed_W = (1 - cover.share) * way_W + cover.share * *shortest_W;
      const double depth_m = mixed_W.norm();
      if (depth_m > 0) {
        const double sign = contact.normal_W.dot(out_W) > 0 ? 1 : -1;
        contact.normal_W = sign / depth_m * mixed_W;
        contact.bristle_W -= contact.normal_W * contact.normal_W.dot(contact.bristle_W);
        contact.depth_m = depth_m;
      }
    }
  }
  // If the point is inside several shapes, each of them has a contact here. The area is divided among these contacts.
  const double own = std::min(way_W.norm(), kShared_m);
  double all = own;
  for (const PlacedShape& other : others_) all += std::clamp(-distance_m(other, p_W), 0.0, kShared_m);
  contact.area_m2 *= own / all;
}

// Reduces the area of a contact with a gap if another shape is nearer to the point and also covers the surface point
// below it. At a joint of two shapes, the edge of the farther shape is thus no obstacle.
void ShapeUnion::correct_gap(ContactPoint& contact, const Vec3& out_W) const noexcept {
  const double gap_m = -contact.depth_m;
  if (!(gap_m > 0)) return;
  for (const PlacedShape& other : others_) {
    const double nearer = 1 - distance_m(other, contact.p_W) / gap_m;
    if (!(nearer > 0.02)) continue;
    const Vec3 foot_W = contact.p_W - gap_m * out_W;
    const double blend = blend_m(own_, other, foot_W);
    const double foot = distance_m(other, foot_W) / blend;
    contact.area_m2 *= 1 - ramp(nearer, 0.02, 0.1) * ramp(1 - foot, 0, 0.5);
  }
}

double ShapeUnion::covered_share(const Vec3& p_W, const Vec3& normal_W) const noexcept {
  double most = 0;
  for (const PlacedShape& other : others_) {
    const double blend = blend_m(own_, other, p_W);
    const double at = distance_m(other, p_W) / blend;
    if (at >= 1) continue;
    const double beyond = distance_m(other, p_W + blend * normal_W) / blend;
    const double ahead = ramp(at - beyond, 0.1, 0.4) * ramp(1 - at, 0, 0.5);
    const double flush = ramp(beyond - at, 0.2, 0.5) * ramp(0.95 - beyond, 0, 0.1);
    most = std::max({most, ahead, flush, ramp(-at, 0.1, 0.5)});
  }
  return most;
}

}  // namespace tandem::contact

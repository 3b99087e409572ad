#include "common/contact/round/rod_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "common/contact/contact_point.hpp"

namespace tandem::contact {
namespace {

/// Positions and weights of the Gauss-Legendre quadrature with five points on [−1, 1].
constexpr std::array kGaussPlaces = {-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                     0.9061798459386640};
constexpr std::array kGaussWeights = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                      0.2369268850561891};
// The strip with which a rod presses is divided across its width into a middle part and two equal outer parts.
// kMiddleShare is the middle part's fraction of the width. kMiddleDepth and kRestDepth are the mean depths of the
// middle part and of the outer parts, relative to the depth in the middle of the strip. kRestAside is the distance of
// the outer parts from the middle, relative to half of the width.
constexpr double kMiddleShare = 0.2;
constexpr double kMiddleDepth = 1 - kMiddleShare * kMiddleShare / 3;
constexpr double kRestDepth = (2.0 / 3 - kMiddleShare * kMiddleDepth) / (1 - kMiddleShare);
constexpr double kRestAside = (1 + kMiddleShare) / 2;
// Thickness of the deepest slice of a round end, as a fraction of the depth.
constexpr double kFirstSlice = 0.05;
// The area of a contact with a gap is that of a slice of a round end with this thickness.
constexpr double kGapSlice_m = 1.6e-5;
// Two axes count as parallel, without a common normal, if the sine of the angle between them is below this value.
constexpr double kParallelSine = 1e-3;
// Least curvature of the depth along A's axis, in 1/m. It ensures that the quadratic equation for the ends of the
// pressing part has two roots. It changes the depth by 10 pm at 0.1 m from the middle.
constexpr double kMinBend_per_m = 1e-9;
// The edge of a flat end counts as touched if the component of the normal along the rod's axis exceeds this value.
constexpr double kEdgeSlope = 0.1;

/// Returns 0 below `low`, 1 above `high`, linear in between.
double rod_ramp(double value, double low, double high) {
  return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : (value > low ? 1.0 : 0.0);
}

/// A rod at its pose in the world.
struct PlacedRod {
  PlacedRod(const Rod& rod, const Pose& X_WR)
      : centre_W(X_WR.p),
        axis_W(X_WR.q * Vec3::UnitZ()),
        radius_m(rod.radius_m),
        half_m(rod.half_length_m),
        has_round_ends(rod.has_round_ends) {}

  Vec3 at(double along_m) const { return centre_W + along_m * axis_W; }
  bool is_ball() const { return half_m == 0; }
  /// Returns the position along the axis that is nearest to p.
  double foot_m(const Vec3& p_W) const { return std::clamp(axis_W.dot(p_W - centre_W), -half_m, half_m); }
  /// Returns the direction out of the rod along its axis at an end; zero if `along_m` is between the ends.
  Vec3 outward_W(double along_m) const {
    if (is_ball() || std::abs(along_m) < half_m) return Vec3::Zero();
    return along_m > 0 ? axis_W : Vec3(-axis_W);
  }

  Vec3 centre_W, axis_W;
  double radius_m, half_m;
  bool has_round_ends;
};

/// Nearest points of two axes.
struct NearestOfAxes {
  NearestOfAxes(const PlacedRod& a, const PlacedRod& b) {
    const Vec3 apart = a.centre_W - b.centre_W;
    const double cosine = a.axis_W.dot(b.axis_W), of_a = a.axis_W.dot(apart), of_b = b.axis_W.dot(apart);
    const double sine_squared = (a.axis_W - cosine * b.axis_W).squaredNorm();
    const bool is_parallel = sine_squared < kParallelSine * kParallelSine;
    double unbounded_m = 0;
    if (sine_squared > 0) unbounded_m = (cosine * of_b - of_a) / sine_squared;
    on_a_m = std::clamp(std::isfinite(unbounded_m) ? unbounded_m : 0.0, -a.half_m, a.half_m);
    const double foot_m = of_b + on_a_m * cosine;
    on_b_m = std::clamp(foot_m, -b.half_m, b.half_m);
    is_between_ends = !is_parallel && std::abs(unbounded_m) < a.half_m && std::abs(foot_m) < b.half_m;
    if (on_b_m != foot_m) on_a_m = std::clamp(on_b_m * cosine - of_a, -a.half_m, a.half_m);
    way_W = a.at(on_a_m) - b.at(on_b_m);
  }

  double on_a_m = 0, on_b_m = 0;  ///< positions of the nearest points along the axes
  Vec3 way_W = Vec3::Zero();      ///< vector from the point on B to the point on A
  bool is_between_ends = false;   ///< true: both points are between the ends, and way_W is along the common normal
};

/// Contact of an end of one rod with the other rod.
struct End {
  End(const PlacedRod& own, double along_m, const PlacedRod& other) : outward_W(own.outward_W(along_m)) {
    const Vec3 p_W = own.at(along_m);
    const double foot_m = other.foot_m(p_W);
    const Vec3 way_W = p_W - other.at(foot_m);
    const double distance_m = way_W.norm();
    out_of_other_W = distance_m > 0 ? Vec3(way_W / distance_m) : other.axis_W.unitOrthogonal();
    depth_m = own.radius_m + other.radius_m - distance_m;
    place_W = p_W - own.radius_m * out_of_other_W;
    own_share = own.is_ball() ? 1 : round_share(own, -own.radius_m * out_of_other_W.dot(outward_W));
    const double beyond_m = std::abs(foot_m) - other.half_m;
    const double slope = out_of_other_W.dot(other.outward_W(foot_m));
    other_share = other.is_ball() ? 1 : round_share(other, beyond_m < 0 ? beyond_m : other.radius_m * slope);
  }

  /// Returns the fraction of the contact patch that is on the round end of a rod and not on its side. `beyond_m` is the
  /// distance from the start of the round end to the middle of the patch; it is negative if the middle is on the side.
  double round_share(const PlacedRod& rod, double beyond_m) const {
    const double patch_m = std::sqrt(2 * rod.radius_m * std::max(depth_m, 0.0));
    return rod_ramp(beyond_m, -patch_m, patch_m);
  }

  Vec3 outward_W, out_of_other_W = Vec3::UnitZ(), place_W = Vec3::Zero();
  double depth_m = 0;
  double own_share = 0;    ///< fraction of the patch on this end
  double other_share = 0;  ///< fraction of the patch on an end of the other rod
};

/// Appends the contacts of two placed rods.
class RodWriter {
 public:
  RodWriter(const PlacedRod& a, const PlacedRod& b, const NearestOfAxes& nearest, const Vec3& normal_W, double band_m,
            bool puts_on_a, std::vector<ContactPoint>& contacts)
      : a_(a),
        b_(b),
        nearest_(nearest),
        normal_W_(normal_W),
        band_m_(band_m),
        puts_on_a_(puts_on_a),
        contacts_(contacts),
        sum_m_(a.radius_m + b.radius_m) {
    const double cosine = a.axis_W.dot(b.axis_W);
    aside_W_ = a.axis_W - cosine * b.axis_W;
    sine_ = aside_W_.norm();
    gap_area_m2_ = 2 * std::numbers::pi * std::sqrt(a.radius_m * b.radius_m) * kGapSlice_m / std::max(sine_, 0.1);
  }

  void add_strips() {
    const std::optional<std::array<double, 2>> range = pressing_range_m();
    if (!range) {
      id_ += 3 * kGaussPlaces.size();
      return;
    }
    const double middle_m = ((*range)[0] + (*range)[1]) / 2, half_m = ((*range)[1] - (*range)[0]) / 2;
    for (std::size_t i = 0; i < kGaussPlaces.size(); ++i) {
      add_strip(middle_m + half_m * kGaussPlaces[i], half_m * kGaussWeights[i]);
    }
  }

  void add_nearest_gap() {
    const double depth_m = sum_m_ - normal_W_.dot(nearest_.way_W);
    const Vec3 place_W = a_.at(nearest_.on_a_m) - (a_.radius_m - depth_m / 2) * normal_W_;
    if (depth_m > 0) {
      ++id_;
    } else {
      add(place_W, normal_W_, depth_m, gap_area_m2_);
    }
  }

  /// Adds the contacts of the rod's two ends; a ball has only one end.
  void add_ends(bool is_a) {
    const PlacedRod& own = is_a ? a_ : b_;
    const PlacedRod& other = is_a ? b_ : a_;
    for (const double along_m : {own.half_m, -own.half_m}) {
      if (own.is_ball() && along_m == 0 && std::signbit(along_m)) {
        id_ += 2;
        continue;
      }
      const End end(own, along_m, other);
      const Vec3 normal_W = is_a ? end.out_of_other_W : Vec3(-end.out_of_other_W);
      const Vec3 place_W = end.place_W + end.depth_m / 2 * end.out_of_other_W;
      if (end.depth_m <= 0) {
        // For a ball, add_nearest_gap() adds the only contact with a gap, so none is added here.
        const bool is_near = !own.is_ball() && -end.depth_m < band_m_;
        if (is_near) add(place_W, normal_W, end.depth_m, gap_area_m2_);
        id_ += is_near ? 1 : 2;
        continue;
      }
      // If two round ends touch each other, both rods have the same contact. It is added for A only.
      const double share = (own.has_round_ends ? end.own_share : 0) * (is_a ? 1 : 1 - round_share_of(other, end));
      const double side_m = own.radius_m * std::sqrt(other.radius_m / sum_m_);
      const double ball_m = own.radius_m * other.radius_m / sum_m_;
      const double round_m = side_m + (other.has_round_ends ? end.other_share : 0) * (ball_m - side_m);
      const double area_m2 = share * 2 * std::numbers::pi * round_m * end.depth_m;
      add(place_W, normal_W, (1 - kFirstSlice / 2) * end.depth_m, kFirstSlice * area_m2);
      add(place_W, normal_W, (1 - kFirstSlice) / 2 * end.depth_m, (1 - kFirstSlice) * area_m2);
    }
  }

 private:
  static double round_share_of(const PlacedRod& other, const End& end) {
    return other.has_round_ends ? end.other_share : 0;
  }

  /// Returns the depth at the position x on A's axis, relative to the nearest point. The depth is c₀ + c₁ x − c₂ x²,
  /// with (c₀, c₁, c₂) from depth_along_a().
  double depth_at(double x_m) const { return depth_.x() + (depth_.y() - depth_.z() * x_m) * x_m; }
  Vec3 depth_along_a() const {
    const Vec3 apart = a_.at(nearest_.on_a_m) - b_.centre_W;
    const Vec3 from_b = apart - b_.axis_W * b_.axis_W.dot(apart);
    const double along0 = normal_W_.dot(from_b), along1 = normal_W_.dot(aside_W_);
    const Vec3 off0 = from_b - along0 * normal_W_, off1 = aside_W_ - along1 * normal_W_;
    return {sum_m_ - along0 - off0.squaredNorm() / (2 * sum_m_), -along1 - off0.dot(off1) / sum_m_,
            std::max(off1.squaredNorm() / (2 * sum_m_), kMinBend_per_m)};
  }

  /// Returns the half width of a contact strip with this depth in its middle.
  double half_width_m(double depth_m) const {
    return std::sqrt(2 * a_.radius_m * b_.radius_m / sum_m_ * std::max(depth_m, 0.0));
  }

  /// Returns how far the contact strip of this depth extends beyond an end of B.
  double overhang_m(double depth_m) const { return half_width_m(depth_m) * sine_; }

  /// Returns the part of A's axis that presses and is beside B: its begin and end, relative to the nearest point.
  std::optional<std::array<double, 2>> pressing_range_m() {
    if (a_.is_ball() || b_.is_ball()) return std::nullopt;
    depth_ = depth_along_a();
    const double root_squared = depth_.y() * depth_.y() + 4 * depth_.z() * depth_.x();
    if (!(root_squared > 0)) return std::nullopt;
    const double sum = depth_.y() + std::copysign(std::sqrt(root_squared), depth_.y());
    const double one = -2 * depth_.x() / sum;
    const double other = sum / (2 * depth_.z());
    double low_m = std::min(one, other), high_m = std::max(one, other);
    low_m = std::max(low_m, -a_.half_m - nearest_.on_a_m);
    high_m = std::min(high_m, a_.half_m - nearest_.on_a_m);
    if (!(high_m > low_m)) return std::nullopt;
    const double top_m = std::clamp(depth_.y() / (2 * depth_.z()), low_m, high_m);
    overhang_m_ = overhang_m(depth_at(top_m));
    const double cosine = a_.axis_W.dot(b_.axis_W), foot_m = b_.axis_W.dot(a_.at(nearest_.on_a_m) - b_.centre_W);
    if (std::abs(cosine) > 0) {
      const double one_end_m = (-b_.half_m - overhang_m_ - foot_m) / cosine,
                   other_end_m = (b_.half_m + overhang_m_ - foot_m) / cosine;
      low_m = std::max(low_m, std::min(one_end_m, other_end_m));
      high_m = std::min(high_m, std::max(one_end_m, other_end_m));
    }
    // If A's nearest point is at a round end of A, a contact of that end replaces the strips there. The area of the
    // strips is reduced accordingly.
    side_share_ = 1;
    if (std::abs(nearest_.on_a_m) == a_.half_m && a_.has_round_ends) {
      const double slope = -normal_W_.dot(a_.outward_W(nearest_.on_a_m));
      const double patch_m = std::sqrt(2 * a_.radius_m * std::max(sum_m_ - normal_W_.dot(nearest_.way_W), 0.0));
      side_share_ = 1 - rod_ramp(a_.radius_m * slope, 0, patch_m);
    }
    if (!(high_m > low_m) || !(side_share_ > 0)) return std::nullopt;
    return std::array{low_m, high_m};
  }

  void add_strip(double x_m, double length_m) {
    const double depth_m = depth_at(x_m), half_m = half_width_m(depth_m);
    const Vec3 on_axis_W = a_.at(nearest_.on_a_m + x_m);
    const double beyond_m = std::abs(b_.axis_W.dot(on_axis_W - b_.centre_W)) - b_.half_m;
    const double beside_share = overhang_m_ > 0 ? 1 - rod_ramp(beyond_m, -overhang_m_, overhang_m_) : 1;
    const double area_m2 = side_share_ * beside_share * 2 * half_m * length_m;
    const Vec3 place_W = on_axis_W - (a_.radius_m - depth_m / 2) * normal_W_;
    const Vec3 across_W = kRestAside * half_m * a_.axis_W.cross(normal_W_);
    add(place_W, normal_W_, kMiddleDepth * depth_m, kMiddleShare * area_m2);
    add(place_W - across_W, normal_W_, kRestDepth * depth_m, (1 - kMiddleShare) / 2 * area_m2);
    add(place_W + across_W, normal_W_, kRestDepth * depth_m, (1 - kMiddleShare) / 2 * area_m2);
  }

  /// Appends a contact.
  /// In      place_W  middle of the overlap; the position of the contact is moved from it to the surface of A or B
  void add(const Vec3& place_W, const Vec3& normal_W, double depth_m, double area_m2) {
    const std::uint32_t id = id_++;
    if (!(area_m2 > 0)) return;
    contacts_.push_back({.p_W = place_W + (puts_on_a_ ? -0.5 : 0.5) * depth_m * normal_W,
                         .normal_W = normal_W,
                         .depth_m = depth_m,
                         .area_m2 = area_m2,
                         .bristle_W = Vec3::Zero(),
                         .id = id});
  }

  const PlacedRod& a_;
  const PlacedRod& b_;
  const NearestOfAxes& nearest_;
  Vec3 normal_W_;
  double band_m_;
  bool puts_on_a_;
  std::vector<ContactPoint>& contacts_;
  double sum_m_;
  Vec3 aside_W_ = Vec3::Zero();  ///< component of A's axis perpendicular to B's axis
  double sine_ = 0;
  double gap_area_m2_ = 0;
  Vec3 depth_ = Vec3::Zero();  ///< coefficients of depth_at()
  double overhang_m_ = 0;      ///< result of overhang_m() for the deepest strip
  double side_share_ = 1;      ///< fraction of the patch that is on A's side surface, not on a round end of A
  std::uint32_t id_ = ContactPoint::kClosedForm;
};

/// Returns whether the other rod touches a flat end of `rod`, or the edge of that end.
///
/// In      along_m  position of the nearest point on the axis of `rod`
///         out_W    unit vector from that point to the other rod
bool meets_flat_end(const PlacedRod& rod, double along_m, const Vec3& out_W, const PlacedRod& other,
                    double other_along_m, double depth_m) {
  if (rod.has_round_ends) return false;
  const bool is_at_end = std::abs(along_m) == rod.half_m;
  if (is_at_end && std::abs(other_along_m) == other.half_m) return true;
  if (out_W.dot(rod.outward_W(along_m)) > kEdgeSlope) return true;
  // Near a flat end, the shortest way out of the rod may lead through the end and not through the side.
  const double beside_m = std::abs(rod.foot_m(other.at(other.half_m)) - rod.foot_m(other.at(-other.half_m)));
  return std::max(rod.half_m - std::abs(along_m), beside_m) < depth_m;
}

}  // namespace

bool RodContacts::find(const Rod& rod_a, const Pose& X_WA, const Rod& rod_b, const Pose& X_WB, double band_m,
                       bool puts_on_a, std::vector<ContactPoint>& contacts) noexcept {
  const PlacedRod a(rod_a, X_WA), b(rod_b, X_WB);
  const NearestOfAxes nearest(a, b);
  const double sum_m = a.radius_m + b.radius_m, distance_m = nearest.way_W.norm();
  if (distance_m > sum_m + band_m) {
    forget();
    return true;
  }
  Vec3 normal_W = distance_m > 0 ? Vec3(nearest.way_W / distance_m) : a.axis_W.unitOrthogonal();
  const Vec3 side_W = X_WB.q * side_B_;
  if (nearest.is_between_ends) {
    const Vec3 common_W = a.axis_W.cross(b.axis_W).normalized();
    const bool had_side = side_W != Vec3::Zero();
    const double side = common_W.dot(had_side ? side_W : normal_W);
    const Vec3 kept_W = side < 0 ? Vec3(-common_W) : common_W;
    // If A is on the other side of B's axis by more than the sum of the radii, A has not passed through B but was
    // placed there, for example by a reset. The stored side is then replaced.
    if (kept_W.dot(nearest.way_W) > -sum_m) normal_W = kept_W;
    side_B_ = X_WB.q.conjugate() * normal_W;
  } else {
    forget();
  }
  const double depth_m = sum_m - normal_W.dot(nearest.way_W);
  if (meets_flat_end(a, nearest.on_a_m, -normal_W, b, nearest.on_b_m, depth_m) ||
      meets_flat_end(b, nearest.on_b_m, normal_W, a, nearest.on_a_m, depth_m)) {
    return false;
  }
  RodWriter writer(a, b, nearest, normal_W, band_m, puts_on_a, contacts);
  writer.add_strips();
  writer.add_nearest_gap();
  writer.add_ends(true);
  writer.add_ends(false);
  return true;
}

}  // namespace tandem::contact

#include "common/contact/shape_distance.hpp"

#include <limits>

namespace tandem::contact {
namespace {

/// Among the points of a shell searched so far, the one with the smallest distance to the other shape's surface.
struct Nearest {
  double distance_m = 0;
  Vec3 p_S = Vec3::Zero();  ///< position of the point in the frame of its shell
  bool is_found = false;
};

/// Replaces `nearest` by the point of `shell` with the smallest distance in `field`, if that distance is smaller.
void search(const PointShell& shell, const DistanceField& field, const Pose& X_FS, Nearest& nearest) noexcept {
  std::uint32_t index = 0;
  while (index < shell.nodes.size()) {
    const ShellNode& node = shell.nodes[index];
    const double at_centre = field.distance_m(X_FS * node.centre_S.cast<double>());
    if (at_centre - node.radius_m >= nearest.distance_m) {
      index = node.next;
      continue;
    }
    if (node.is_leaf) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Vec3 p_S = shell.points[i].p_S.cast<double>();
        const double distance = field.distance_m(X_FS * p_S);
        if (distance < nearest.distance_m) nearest = {distance, p_S, true};
      }
    }
    index = node.is_leaf ? node.next : index + 1;
  }
}

/// Returns whether a point of `shell` is deeper than `depth_m` in `field`.
bool has_deeper(const PointShell& shell, const DistanceField& field, const Pose& X_FS, double depth_m) noexcept {
  std::uint32_t index = 0;
  while (index < shell.nodes.size()) {
    const ShellNode& node = shell.nodes[index];
    const double depth = -field.distance_m(X_FS * node.centre_S.cast<double>());
    // Along the node's ball, the depth differs from that at its centre by at most the radius. If the centre is deeper
    // than `depth_m` by more than the radius, so are all points of the node.
    if (depth > depth_m + node.radius_m) return true;
    const bool may_be_deeper = depth + node.radius_m > depth_m;
    if (may_be_deeper && node.is_leaf) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (-field.distance_m(X_FS * shell.points[i].p_S.cast<double>()) > depth_m) return true;
      }
    }
    index = may_be_deeper && !node.is_leaf ? index + 1 : node.next;
  }
  return false;
}

/// Returns the gap between the surfaces near a sample. It projects a point alternately onto both surfaces.
double refined(const Nearest& from, const DistanceField& own, const DistanceField& other, const Pose& X_OS) noexcept {
  constexpr int kRounds = 8;
  const Pose X_SO = X_OS.inverse();
  double nearest = from.distance_m;
  Vec3 p_O = X_OS * from.p_S;
  for (int i = 0; i < kRounds && nearest > 0; ++i) {
    const DistanceSample there = other.sample(p_O);
    const Vec3 p_S = X_SO * Vec3(p_O - there.distance_m * there.gradient);
    const DistanceSample back = own.sample(p_S);
    if (!(back.distance_m < nearest)) break;
    nearest = back.distance_m;
    p_O = X_OS * Vec3(p_S - back.distance_m * back.gradient);
  }
  return nearest;
}

/// Returns whether two boxes are farther apart than `gap_m`: A's box, and the box along A's axes around B's rotated
/// box.
bool is_apart(const ContactShape& a, const ContactShape& b, const Pose& X_AB, double gap_m) noexcept {
  const Vec3 centre_a = (a.low_S + a.high_S) / 2;
  const Vec3 centre_b = X_AB * Vec3((b.low_S + b.high_S) / 2);
  const Vec3 half_b = X_AB.q.toRotationMatrix().cwiseAbs() * ((b.high_S - b.low_S) / 2);
  const Vec3 gap = (centre_b - centre_a).cwiseAbs() - (a.high_S - a.low_S) / 2 - half_b;
  return gap.maxCoeff() > gap_m;
}

}  // namespace

bool overlaps(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
              double depth_m) noexcept {
  const Pose X_BA = X_WB.inverse() * X_WA;
  return has_deeper(a.shells.surface, *b.field, X_BA, depth_m) ||
         has_deeper(b.shells.surface, *a.field, X_BA.inverse(), depth_m);
}

bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept {
  const Pose X_AB = X_WA.inverse() * X_WB;
  return !is_apart(a, b, X_AB, gap_m) && !is_apart(b, a, X_AB.inverse(), gap_m);
}

double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept {
  // The point of a shell that is found may be up to one spacing away from the nearest point of the surface. The search
  // distance is therefore increased by the spacings of both shells.
  const double reach = limit_m + a.shells.surface.spacing_m + b.shells.surface.spacing_m;
  const Pose X_BA = X_WB.inverse() * X_WA;
  const Pose X_AB = X_BA.inverse();
  Nearest of_a{reach, Vec3::Zero(), false};
  search(a.shells.surface, *b.field, X_BA, of_a);
  double nearest = of_a.is_found ? refined(of_a, *a.field, *b.field, X_BA) : reach;
  Nearest of_b{of_a.distance_m, Vec3::Zero(), false};
  search(b.shells.surface, *a.field, X_AB, of_b);
  if (of_b.is_found) nearest = std::min(nearest, refined(of_b, *b.field, *a.field, X_AB));
  // The tolerance of 1 nm allows for rounding.
  return nearest <= limit_m + 1e-9 ? std::min(nearest, limit_m) : std::numeric_limits<double>::infinity();
}

}  // namespace tandem::contact

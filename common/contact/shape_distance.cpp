#include "common/contact/shape_distance.hpp"

#include <limits>

namespace tandem {
namespace {

/// Lowers `nearest` to the smallest distance of a point of `shell` in `field`, if there is a smaller one.
void search(const PointShell& shell, const DistanceField& field, const Pose& X_FS, double& nearest) noexcept {
  std::uint32_t index = 0;
  while (index < shell.nodes.size()) {
    const ShellNode& node = shell.nodes[index];
    const double at_centre = field.distance_m(X_FS * node.centre_S.cast<double>());
    if (at_centre - node.radius_m >= nearest) {
      index = node.next;
      continue;
    }
    if (node.is_leaf) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        nearest = std::min(nearest, field.distance_m(X_FS * shell.points[i].p_S.cast<double>()));
      }
    }
    index = node.is_leaf ? node.next : index + 1;
  }
}

/// B's box, turned into A's axes, against A's box.
bool is_apart(const ContactShape& a, const ContactShape& b, const Pose& X_AB, double gap_m) noexcept {
  const Vec3 centre_a = (a.low_S + a.high_S) / 2;
  const Vec3 centre_b = X_AB * Vec3((b.low_S + b.high_S) / 2);
  const Vec3 half_b = X_AB.q.toRotationMatrix().cwiseAbs() * ((b.high_S - b.low_S) / 2);
  const Vec3 gap = (centre_b - centre_a).cwiseAbs() - (a.high_S - a.low_S) / 2 - half_b;
  return gap.maxCoeff() > gap_m;
}

}  // namespace

bool boxes_are_near(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                    double gap_m) noexcept {
  const Pose X_AB = X_WA.inverse() * X_WB;
  return !is_apart(a, b, X_AB, gap_m) && !is_apart(b, a, X_AB.inverse(), gap_m);
}

double shape_distance_m(const ContactShape& a, const Pose& X_WA, const ContactShape& b, const Pose& X_WB,
                        double limit_m) noexcept {
  // One bit above the limit, so that a gap of exactly the limit still counts.
  double nearest = std::nextafter(limit_m, std::numeric_limits<double>::infinity());
  const Pose X_BA = X_WB.inverse() * X_WA;
  search(a.shells.surface, *b.field, X_BA, nearest);
  search(b.shells.surface, *a.field, X_BA.inverse(), nearest);
  return nearest <= limit_m ? nearest : std::numeric_limits<double>::infinity();
}

}  // namespace tandem

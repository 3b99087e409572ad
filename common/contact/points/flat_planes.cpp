#include "common/contact/points/flat_planes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/contact/points/flat_node.hpp"
#include "common/contact/points/point_shell.hpp"

namespace tandem::contact {
namespace {

constexpr float kMinArea_m2 = 4e-6F;
// Maximum number of flat nodes from which planes are computed. The largest nodes are used. The limit bounds the work
// that a received shape can cause.
constexpr std::size_t kMaxNodes = 1024;
// Two nodes are on one plane if two conditions hold. The mean of one is within kSamePlane_m of the plane of the other,
// and the sine of the angle between their normals is below kSameNormalSine.
constexpr double kSamePlane_m = 5e-6;
constexpr double kSameNormalSine = 1e-3;
// Conditions for a node that defines a plane: minimum cosine of the angle between the plane's normal and the points'
// normals, and minimum half width of the node.
constexpr double kFacing = 0.995;
constexpr float kMinHalf_m = 5e-4F;

/// Sums over the flat nodes that lie on one plane.
struct OnePlane {
  double area_m2 = 0;
  Vec3 mean = Vec3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< sum of covariance × area
  Vec3 normal = Vec3::Zero();

  bool has(const Vec3& other_mean, const Vec3& other_normal) const {
    return normal.cross(other_normal).norm() < kSameNormalSine && normal.dot(other_normal) > 0 &&
           std::abs(normal.dot(other_mean - mean)) < kSamePlane_m;
  }
  void add(const FlatNode& flat, double area, const Vec3& out) {
    const Vec3 along = flat.deviation_along_m * flat.along_S.cast<double>();
    const Vec3 across = flat.deviation_across_m * flat.across_S.cast<double>();
    const Vec3 way = flat.mean_S.cast<double>() - mean;
    const double sum = area_m2 + area;
    covariance +=
        area * (along * along.transpose() + across * across.transpose() + area_m2 / sum * way * way.transpose());
    mean += area / sum * way;
    area_m2 = sum;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    normal = solver.eigenvectors().col(0);
    if (normal.dot(out) < 0) normal = -normal;
  }
};

}  // namespace

std::vector<FieldPlane> planes_of(const PointShell& surface) {
  std::vector<const ShellNode*> flats;
  for (std::size_t i = 0; i < surface.nodes.size();) {
    const ShellNode& node = surface.nodes[i];
    const bool is_flat = node.flat != ShellNode::kNotFlat;
    if (is_flat && node.mean.area_m2 >= kMinArea_m2) flats.push_back(&node);
    i = is_flat ? node.next : i + 1;
  }
  std::ranges::stable_sort(flats,
                           [](const ShellNode* a, const ShellNode* b) { return a->mean.area_m2 > b->mean.area_m2; });
  if (flats.size() > kMaxNodes) flats.resize(kMaxNodes);
  std::vector<OnePlane> planes;
  for (const ShellNode* node : flats) {
    const FlatNode& flat = surface.flat_nodes[node->flat];
    const Vec3 out = node->mean.normal_S.cast<double>();
    Vec3 normal = flat.along_S.cast<double>().cross(flat.across_S.cast<double>());
    if (normal.dot(out) < 0) normal = -normal;
    // The points of a sharp edge may be on one plane, but they do not define a plane of the surface: their normals
    // point elsewhere.
    if (normal.dot(out) < kFacing || flat.half_m.head<2>().minCoeff() < kMinHalf_m) continue;
    const Vec3 mean = flat.mean_S.cast<double>();
    auto plane = std::ranges::find_if(planes, [&](const OnePlane& other) { return other.has(mean, normal); });
    if (plane == planes.end()) plane = planes.insert(planes.end(), OnePlane{});
    plane->add(flat, node->mean.area_m2, out);
  }
  std::ranges::stable_sort(planes, [](const OnePlane& a, const OnePlane& b) { return a.area_m2 > b.area_m2; });
  if (planes.size() > kMaxPlanes) planes.resize(kMaxPlanes);
  std::vector<FieldPlane> found;
  for (const OnePlane& plane : planes) found.push_back({plane.normal, -plane.normal.dot(plane.mean)});
  return found;
}

}  // namespace tandem::contact

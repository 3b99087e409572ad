#include "common/geometry/shading.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>
#include <set>
#include <unordered_map>

namespace tandem::geometry {
namespace {

using Triangle = std::array<int, 3>;

/// Cosine of the largest angle between faces that belong to the same smooth surface.
const double kSmoothCosine = std::cos(40 * std::numbers::pi / 180);

/// Returns the normal of a triangle, with twice its area as length; zero if an index is out of range.
Vec3 area_normal(const TriangleMesh& mesh, const Triangle& corners) {
  const auto is_in_mesh = [&mesh](int corner) {
    return corner >= 0 && static_cast<std::size_t>(corner) < mesh.vertices.size();
  };
  if (!std::ranges::all_of(corners, is_in_mesh)) return Vec3::Zero();
  const auto at = [&](int corner) -> const Vec3& {
    return mesh.vertices[static_cast<std::size_t>(corners.at(corner))];
  };
  return (at(1) - at(0)).cross(at(2) - at(0));
}

/// Assigns each corner of a face to an output vertex. An input vertex has one output vertex for each smooth surface
/// around it.
class SmoothGroups {
 public:
  explicit SmoothGroups(const TriangleMesh& mesh) : mesh_(mesh), first_(mesh.vertices.size(), -1) {
    out_.first.vertices.reserve(mesh.vertices.size());
  }

  void add(const Triangle& corners) {
    const Vec3 normal = area_normal(mesh_, corners);
    if (!(normal.squaredNorm() > 0)) return;
    Triangle made{};
    for (std::size_t k = 0; k < 3; ++k) made.at(k) = group_of(static_cast<std::size_t>(corners.at(k)), normal);
    out_.first.triangles.push_back(made);
  }

  ShadedMesh finish() {
    for (Vec3& normal : out_.second) normal.normalize();
    return std::move(out_);
  }

 private:
  int group_of(std::size_t vertex, const Vec3& normal) {
    int* link = &first_[vertex];
    for (; *link >= 0; link = &next_[static_cast<std::size_t>(*link)]) {
      Vec3& sum = out_.second[static_cast<std::size_t>(*link)];
      if (sum.dot(normal) < kSmoothCosine * sum.norm() * normal.norm()) continue;
      sum += normal;
      return *link;
    }
    const int made = *link = static_cast<int>(next_.size());
    next_.push_back(-1);  // this may invalidate `link`
    out_.first.vertices.push_back(mesh_.vertices[vertex]);
    out_.second.push_back(normal);
    return made;
  }

  const TriangleMesh& mesh_;
  std::vector<int> first_;  ///< first output vertex of each input vertex; −1 if there is none
  std::vector<int> next_;   ///< next output vertex of the same input vertex
  ShadedMesh out_;
};

/// Returns the key of a cell, whose indices must be below 2²¹.
std::uint64_t key_of(const Vec3& cell) {
  std::uint64_t key = 0;
  for (const double index : cell) key = key << 21U | static_cast<std::uint64_t>(index);
  return key;
}

/// Returns the mesh in which the vertices of each cell are merged.
TriangleMesh clustered(const TriangleMesh& mesh, const Vec3& origin, double width) {
  std::unordered_map<std::uint64_t, int> numbers;
  std::vector<int> cluster_of;
  std::vector<Vec3> low;  // lowest corner of each cell
  for (const Vec3& vertex : mesh.vertices) {
    const Vec3 at = ((vertex - origin) / width).array().floor();
    const auto [found, is_new] = numbers.try_emplace(key_of(at), static_cast<int>(low.size()));
    if (is_new) low.emplace_back(origin + width * at);
    cluster_of.push_back(found->second);
  }
  const std::size_t count = low.size();
  std::vector<Eigen::Matrix3d> normal_matrices(count, Eigen::Matrix3d::Zero());
  std::vector<Vec3> right(count, Vec3(0, 0, 0)), middle(count, Vec3(0, 0, 0));
  std::vector<double> members(count, 0);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const auto cluster = static_cast<std::size_t>(cluster_of[i]);
    middle[cluster] += mesh.vertices[i];
    members[cluster] += 1;
  }
  for (std::size_t i = 0; i < count; ++i) middle[i] /= members[i];
  TriangleMesh out;
  std::set<Triangle> known;
  for (const Triangle& corners : mesh.triangles) {
    const Vec3 normal = area_normal(mesh, corners);
    Triangle made{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(corners.at(k));
      made.at(k) = cluster_of[corner];
      const auto cluster = static_cast<std::size_t>(made.at(k));
      normal_matrices[cluster] += normal * normal.transpose();
      right[cluster] += normal * normal.dot(mesh.vertices[corner] - middle[cluster]);
    }
    if (made[0] == made[1] || made[1] == made[2] || made[2] == made[0]) continue;
    std::rotate(made.begin(), std::min_element(made.begin(), made.end()), made.end());
    if (known.insert(made).second) out.triangles.push_back(made);
  }
  for (std::size_t i = 0; i < count; ++i) {
    // The small diagonal term is for directions that no face determines: along these, the vertex stays near the mean
    // position.
    const double trace = normal_matrices[i].trace();
    const Eigen::Matrix3d held = normal_matrices[i] + 1e-3 * trace * Eigen::Matrix3d::Identity();
    const Vec3 away = trace > 0 ? Vec3(held.ldlt().solve(right[i])) : Vec3(0, 0, 0);
    out.vertices.emplace_back((middle[i] + away).cwiseMax(low[i]).cwiseMin(low[i] + Vec3::Constant(width)));
  }
  return out;
}

}  // namespace

ShadedMesh shaded(const TriangleMesh& mesh) {
  SmoothGroups groups(mesh);
  for (const Triangle& corners : mesh.triangles) groups.add(corners);
  return groups.finish();
}

TriangleMesh decimated(const TriangleMesh& mesh, std::size_t most) {
  constexpr double kWider = 1.15;
  if (mesh.triangles.size() <= most) return mesh;
  Eigen::AlignedBox3d box;
  for (const Vec3& vertex : mesh.vertices) box.extend(vertex);
  const double twice_area = std::transform_reduce(mesh.triangles.begin(), mesh.triangles.end(), 0.0, std::plus<>(),
                                                  [&mesh](const Triangle& t) { return area_normal(mesh, t).norm(); });
  // With this width, there are about two triangles per cell. Its lower limit ensures that the index of a cell fits into
  // 21 bits of a key.
  double width = std::max(std::sqrt(twice_area / static_cast<double>(most)), box.sizes().maxCoeff() * 1e-5);
  if (!(width > 0)) return {};
  while (true) {
    TriangleMesh fewer = clustered(mesh, box.min(), width);
    if (fewer.triangles.size() <= most) return fewer;
    width *= std::max(kWider, std::sqrt(static_cast<double>(fewer.triangles.size()) / static_cast<double>(most)));
  }
}

}  // namespace tandem::geometry

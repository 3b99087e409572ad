#include "lab/studies/contact/wall_thickness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::lab {
namespace {

constexpr double kThinShare = 0.02;
constexpr double kOppositeCosine = 1 / std::numbers::sqrt2;
/// Surfaces coincide if their distance is below this fraction of the mesh's size.
constexpr double kCoincident = 1e-9;
/// Maximum number of surfaces that a measured line may cross; lines with more are skipped.
constexpr std::size_t kMaxCrossings = 4096;
/// Steps of a low-discrepancy sequence in the unit square (R2 sequence). They are 1/ρ and 1/ρ², where ρ = 1.3247… is
/// the plastic number.
constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;

/// A point on the surface behind which the wall thickness is measured.
struct Place {
  Vec3 p = Vec3::Zero();
  std::size_t triangle = 0;
};

/// Divides the surface into equal areas and returns one point in each.
std::vector<Place> places_on(const geometry::TriangleMesh& mesh) {
  std::vector<double> area_up_to;
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    area_up_to.push_back(area += geometry::doubled_area(mesh, t).norm());
  }
  std::vector<Place> places;
  for (std::size_t i = 0; i < kWallPoints && area > 0; ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(kWallPoints);
    const auto found = std::ranges::upper_bound(area_up_to, share * area);
    const auto t = static_cast<std::size_t>(found - area_up_to.begin());
    const auto corner = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][k])]; };
    double whole = 0;
    // The steps are irrational. Therefore the points lie at no regular position, and the measured line practically
    // never hits an edge of another triangle, even in a regular mesh.
    double u = std::modf(static_cast<double>(i + 1) * kStepU, &whole);
    double v = std::modf(static_cast<double>(i + 1) * kStepV, &whole);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    places.push_back({corner(0) + u * (corner(1) - corner(0)) + v * (corner(2) - corner(0)), t});
  }
  return places;
}

/// Intersection of the measured line with the surface.
struct Crossing {
  double at_m = 0;  ///< distance along the line from the measured point, positive into the solid
  bool is_exit = false;
  bool is_opposite = false;
};

class Walls {
 public:
  explicit Walls(const geometry::TriangleMesh& mesh) : mesh_(mesh), tree_(mesh), found_(kMaxCrossings) {
    Vec3 low = mesh.vertices.front(), high = low;
    for (const Vec3& vertex : mesh.vertices) {
      low = low.cwiseMin(vertex);
      high = high.cwiseMax(vertex);
    }
    coincident_m_ = kCoincident * (high - low).maxCoeff();
  }

  /// Returns the wall thickness behind a surface point, or nullopt if the point lies inside the solid.
  std::optional<double> behind(const Place& place) {
    cross(place);
    // A solid may consist of several closed parts. `outside` is the number of parts that contain the points just
    // outside the surface. `here` is the number of parts that the line enters at the surface itself, including the part
    // of the measured point.
    int outside = 0, here = 1;
    for (const Crossing& crossing : crossings_) {
      if (crossing.at_m > coincident_m_) continue;
      (crossing.at_m < -coincident_m_ ? outside : here) += crossing.is_exit ? -1 : 1;
    }
    int inside = std::max(outside, 0) + here;
    overlaps_ += inside > 1 ? 1 : 0;
    if (outside > 0) return std::nullopt;
    for (const Crossing& crossing : crossings_) {
      if (crossing.at_m <= coincident_m_) continue;
      inside += crossing.is_exit ? -1 : 1;
      if (inside <= 0) return crossing.is_opposite ? crossing.at_m : std::numeric_limits<double>::infinity();
    }
    return std::numeric_limits<double>::infinity();
  }
  std::size_t overlaps() const { return overlaps_; }

 private:
  void cross(const Place& place) {
    const Vec3 inwards = -geometry::doubled_area(mesh_, place.triangle).normalized();
    crossings_.clear();
    const std::size_t count = tree_.crossed(place.p, inwards, found_);
    for (std::size_t i = 0; i < count && count <= found_.size(); ++i) {
      const auto& [triangle, a, ab, ac] = found_[i];
      if (static_cast<std::size_t>(triangle) == place.triangle) continue;
      const Vec3 normal = ab.cross(ac);
      const double along = normal.dot(inwards);
      crossings_.push_back({normal.dot(a - place.p) / along, along > 0, along >= kOppositeCosine * normal.norm()});
    }
    // Sorts the crossings by their distance. If one part ends where another begins, the entry into the second part must
    // be sorted before the exit. Otherwise the line would seem to leave the solid where the parts touch.
    const auto order = [this](const Crossing& crossing) {
      return crossing.is_exit ? crossing.at_m : crossing.at_m - 2 * coincident_m_;
    };
    std::ranges::sort(crossings_, std::less<>(), order);
  }

  const geometry::TriangleMesh& mesh_;
  geometry::TriangleTree tree_;
  double coincident_m_ = 0;
  std::vector<geometry::TriangleTree::Near> found_;
  std::vector<Crossing> crossings_;
  std::size_t overlaps_ = 0;
};

}  // namespace

std::pair<std::vector<double>, double> walls_of(const geometry::TriangleMesh& solid) {
  Walls walls(solid);
  std::vector<double> thickness_m;
  for (const Place& place : places_on(solid)) {
    if (const std::optional<double> wall_m = walls.behind(place)) thickness_m.push_back(*wall_m);
  }
  std::ranges::sort(thickness_m);
  return {std::move(thickness_m), static_cast<double>(walls.overlaps()) / static_cast<double>(kWallPoints)};
}

double thinnest_wall_m(const std::vector<double>& walls_m) {
  if (walls_m.empty()) return 0;
  const double thinnest_m = walls_m[static_cast<std::size_t>(kThinShare * static_cast<double>(walls_m.size()))];
  return std::isfinite(thinnest_m) ? thinnest_m : 0;
}

}  // namespace tandem::lab

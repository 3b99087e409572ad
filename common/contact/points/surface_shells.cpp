// Converts spread samples to the shells of a shape. A solid's samples are used directly. The samples of a sheet become
// points on both sides of a plate and around its rim. The samples of a primitive are moved to its exact surface.
#include <numbers>

#include "common/contact/contact_shape_options.hpp"
#include "common/contact/points/point_shell.hpp"
#include "common/contact/points/shell_sampling.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {
namespace {

// Limit of the number of points of a primitive. Primitives are sampled when a scene is loaded. Sampling a table 0.5 m
// wide with this many points takes 0.3 s.
constexpr std::size_t kPrimitivePoints = 20'000;
// Factor by which the spacing is reduced on the tessellation of a primitive. It is slightly inside a round primitive,
// so its points are farther apart when they have been moved outwards to the surface.
constexpr double kOutlineMargin = 0.998;
// Factor by which the spacing is reduced on the middle surface of a sheet. The outer side of a bent sheet is longer
// than the middle surface, so its points are farther apart.
constexpr double kSheetDensity = 0.8;

/// A sampled point, and whether it also belongs to the shell of features.
struct Candidate {
  ShellPoint point;
  bool is_feature = false;
};

PointShells shells_of(const std::vector<Candidate>& candidates, double spacing_m) {
  std::vector<ShellPoint> all;
  std::vector<ShellPoint> features;
  all.reserve(candidates.size());
  for (const Candidate& candidate : candidates) {
    all.push_back(candidate.point);
    if (candidate.is_feature) features.push_back(candidate.point);
  }
  return {PointShell::make(std::move(all), spacing_m), PointShell::make(std::move(features), spacing_m)};
}

std::vector<Candidate> candidates_of(const SpreadSamples& spread) {
  std::vector<Candidate> candidates;
  candidates.reserve(spread.samples.size());
  for (std::size_t i = 0; i < spread.samples.size(); ++i) {
    candidates.push_back(
        {{spread.samples[i].p_S, spread.samples[i].normal_S, spread.areas_m2[i]}, spread.is_feature[i]});
  }
  return candidates;
}

/// Samples the surface of the plate whose middle surface is a sheet. The plate is options.sheet_thickness_m thick.
class PlateSampler {
 public:
  PlateSampler(const geometry::SurfaceTopology& sheet, const ContactShapeOptions& options)
      : sheet_(sheet), radius_m_(options.sheet_thickness_m / 2), step_m_(options.feature_spacing_m) {}

  void add_sides(const SpreadSamples& middle) {
    for (std::size_t i = 0; i < middle.samples.size(); ++i) {
      const Vec3 p = middle.samples[i].p_S.cast<double>();
      const Vec3 normal = middle.samples[i].normal_S.cast<double>();
      add(p, normal, middle.areas_m2[i], false);
      add(p, -normal, middle.areas_m2[i], false);
    }
  }

  /// Adds half a tube around the border. Adds a part of a tube along each fold, on the outer side of the fold.
  void add_tubes() {
    for (const geometry::MeshEdge& edge : sheet_.edges) {
      const Vec3 axis = (sheet_.vertex(edge.b) - sheet_.vertex(edge.a)).normalized();
      const Vec3& normal = sheet_.face_normal(edge.left);
      if (edge.right < 0) {
        add_tube(edge, normal, axis, std::numbers::pi);
        continue;
      }
      const double fold = sheet_.fold_rad(edge);
      add_tube(edge, fold > 0 ? normal : Vec3(-normal), fold > 0 ? axis : Vec3(-axis), std::abs(fold));
    }
  }

  /// Adds caps: for each vertex on the rim or on a fold of the sheet, points on a ball around the vertex. Directions in
  /// which an edge is nearer than the vertex are omitted.
  void add_caps() {
    std::vector<std::vector<Vec3>> rays(sheet_.mesh.vertices.size());
    std::vector<bool> is_rim(sheet_.mesh.vertices.size(), false);
    for (const geometry::MeshEdge& edge : sheet_.edges) {
      const Vec3 along = (sheet_.vertex(edge.b) - sheet_.vertex(edge.a)).normalized();
      rays[static_cast<std::size_t>(edge.a)].push_back(along);
      rays[static_cast<std::size_t>(edge.b)].push_back(-along);
      const bool is_sharp = edge.right < 0 || std::abs(sheet_.fold_rad(edge)) * radius_m_ > step_m_;
      if (!is_sharp) continue;
      is_rim[static_cast<std::size_t>(edge.a)] = true;
      is_rim[static_cast<std::size_t>(edge.b)] = true;
    }
    for (std::size_t v = 0; v < rays.size(); ++v) {
      if (is_rim[v]) add_cap(sheet_.mesh.vertices[v], rays[v]);
    }
  }

  /// Returns the candidates without those inside another part of the plate.
  std::vector<Candidate> visible() const {
    const geometry::TriangleTree tree(sheet_.mesh);
    std::vector<Candidate> visible;
    for (const Candidate& candidate : candidates_) {
      const double inside_m = 0.98 * radius_m_;
      if (!(tree.closest(candidate.point.p_S.cast<double>(), inside_m).distance_m < inside_m)) {
        visible.push_back(candidate);
      }
    }
    return visible;
  }

 private:
  void add(const Vec3& p, const Vec3& normal, double area_m2, bool is_feature) {
    candidates_.push_back(
        {{(p + radius_m_ * normal).cast<float>(), normal.cast<float>(), static_cast<float>(area_m2)}, is_feature});
  }

  void add_tube(const geometry::MeshEdge& edge, const Vec3& from, const Vec3& axis, double angle_rad) {
    const int arcs = static_cast<int>(std::ceil(angle_rad * radius_m_ / step_m_));
    if (arcs < 2) return;
    const Vec3 along = sheet_.vertex(edge.b) - sheet_.vertex(edge.a);
    const int pieces = std::max(1, static_cast<int>(std::ceil(along.norm() / step_m_)));
    const double area = angle_rad * radius_m_ * along.norm() / (pieces * (arcs - 1));
    for (int piece = 0; piece < pieces; ++piece) {
      const Vec3 p = sheet_.vertex(edge.a) + along * ((piece + 0.5) / pieces);
      for (int arc = 1; arc < arcs; ++arc) {
        add(p, Eigen::AngleAxisd(angle_rad * arc / arcs, axis) * from, area, true);
      }
    }
  }

  void add_cap(const Vec3& p, const std::vector<Vec3>& rays) {
    // The directions are a Fibonacci lattice. The ball gets one direction per area of step².
    const double golden_rad = std::numbers::pi * (3 - std::sqrt(5.0));
    const double ball = 4 * std::numbers::pi * radius_m_ * radius_m_;
    const int count = std::clamp(static_cast<int>(std::ceil(ball / (step_m_ * step_m_))), 16, 1024);
    for (int i = 0; i < count; ++i) {
      const double z = 1 - (2 * i + 1.0) / count;
      const double radius = std::sqrt(1 - z * z);
      const Vec3 direction(radius * std::cos(golden_rad * i), radius * std::sin(golden_rad * i), z);
      const bool is_nearest =
          std::all_of(rays.begin(), rays.end(), [&](const Vec3& ray) { return direction.dot(ray) <= 0; });
      if (is_nearest) add(p, direction, ball / count, true);
    }
  }

  const geometry::SurfaceTopology& sheet_;
  double radius_m_;
  double step_m_;
  std::vector<Candidate> candidates_;
};

PointShells plate_shells(const geometry::ContactMesh& mesh, const ContactShapeOptions& options,
                         const std::function<void(double)>& progress) {
  const geometry::SurfaceTopology sheet(mesh.mesh);
  ContactShapeOptions middle = options;
  middle.spacing_m *= kSheetDensity;
  middle.max_points /= 2;
  // The middle surface gets no feature samples. Its folds and spikes are round on the plate, where tubes and caps
  // sample them.
  middle.feature_angle_deg = 180;
  middle.feature_height_m = std::numeric_limits<double>::infinity();
  const SpreadSamples spread = spread_samples(sheet, middle, progress);
  PlateSampler plate(sheet, options);
  plate.add_sides(spread);
  plate.add_tubes();
  plate.add_caps();
  return shells_of(plate.visible(), spread.spacing_m / kSheetDensity);
}

/// Moves a point to the surface. A feature point is first moved outwards by `out_m`. Its nearest surface point is then
/// on the edge or corner and not on the face beside it.
void project_to_surface(const DistanceField& field, double out_m, Candidate& candidate) {
  ShellPoint& point = candidate.point;
  Vec3 p = point.p_S.cast<double>();
  if (candidate.is_feature) p += out_m * point.normal_S.cast<double>();
  const DistanceSample sample = field.sample(p);
  point.p_S = (p - sample.distance_m * sample.gradient).cast<float>();
  if (!candidate.is_feature) point.normal_S = sample.gradient.cast<float>();
}

}  // namespace

PointShells sample_surface(const geometry::ContactMesh& mesh, const ContactShapeOptions& options,
                           const std::function<void(double)>& progress) {
  if (mesh.kind == geometry::SurfaceKind::kSheet) return plate_shells(mesh, options, progress);
  const geometry::SurfaceTopology surface(mesh.mesh);
  const SpreadSamples spread = spread_samples(surface, options, progress);
  return shells_of(candidates_of(spread), spread.spacing_m);
}

PointShells sample_surface(const geometry::TriangleMesh& outline, const DistanceField& field,
                           const ContactShapeOptions& options) {
  const geometry::SurfaceTopology surface(outline);
  ContactShapeOptions spread_under = options;
  spread_under.spacing_m *= kOutlineMargin;
  spread_under.max_points = std::min(spread_under.max_points, kPrimitivePoints);
  // A primitive has no bumps (features by height). With a wide spacing, all corners of its tessellation would count as
  // bumps, and sampling a ball of 10 m would take 10 s.
  spread_under.feature_height_m = std::numeric_limits<double>::infinity();
  const SpreadSamples spread = spread_samples(surface, spread_under, {});
  std::vector<Candidate> candidates = candidates_of(spread);
  for (Candidate& candidate : candidates) project_to_surface(field, options.feature_spacing_m, candidate);
  return shells_of(candidates, spread.spacing_m / kOutlineMargin);
}

}  // namespace tandem::contact

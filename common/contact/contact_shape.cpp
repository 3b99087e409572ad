#include "common/contact/contact_shape.hpp"

#include <algorithm>
#include <iomanip>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "common/contact/field/distance_grid.hpp"
#include "common/contact/field/oriented_box.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/contact/points/flat_points.hpp"
#include "common/contact/round/thin_rods.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"
#include "common/geometry/triangle_tree.hpp"

namespace tandem::contact {
namespace {

// Ratio of the rigid depth (depth beyond which contact is as stiff as the step allows) to half of the wall thickness. A
// pressing point must stop before the middle of the wall, because from there the far side is nearer. The ratio has a
// margin, because even a rigid contact yields a little.
constexpr double kRigidShare = 0.4;
static_assert(kRigidShare * kMaxHalfThickness >= kMaxRigidDepth);
// Fraction of the surface, its thinnest parts, that is ignored for the rigid depth. Tips of wedges and spikes, for
// example, have no minimum thickness.
constexpr double kThinShare = 0.02;
// Points that are inside another part of the shape are omitted. A point counts as inside if its depth exceeds this
// multiple of the field's error.
constexpr double kBuriedErrors = 2;
// Gradients below this length occur only on creases of the field, between two faces that are less than a cell apart. A
// distance grid returns gradients of length 0.1 there.
constexpr double kShortGradient = 0.101;
// Maximum rounding error of points' coordinates in single precision, as a fraction of the spacing of points.
constexpr double kRoundingShare = 1e-3;

// A point is on a plane if its distance from the plane is at most kOnPlane_m. It is in the plane's interior if the
// plane equals the field in a box of half edge kInsidePlane_m around the point.
constexpr double kOnPlane_m = 5e-6, kInsidePlane_m = 5e-5;
// Resolution of thin round shapes, in multiples of the radius: spacing of points, largest cell edge, interpolation
// error.
constexpr double kRoundSpacing = 0.5, kRoundCell = 2, kRoundTolerance = 0.1;
// Accuracy to which the half thickness of very thin shapes is measured. why_too_thin() compares the half thickness with
// the thinnest wall that stops a pressing object.
constexpr double kThinnessError_m = 2e-6;
// Radius up to which round shapes are sampled more finely than by default.
constexpr double kThinRadius_m = 4e-4;

/// Returns options whose points are close enough for a round shape of this radius. The surface of the shape extends
/// beyond the nearest point by at most an eighth of the radius.
ContactShapeOptions for_radius(double radius_m, ContactShapeOptions options) {
  if (radius_m > kThinRadius_m) return options;
  options.spacing_m = std::min(options.spacing_m, kRoundSpacing * radius_m);
  options.feature_spacing_m = std::min(options.feature_spacing_m, kRoundSpacing * radius_m);
  options.cell_m = std::min(options.cell_m, std::max(kRoundCell * radius_m, kMinCell_m));
  options.tolerance_m = std::min(options.tolerance_m, kRoundTolerance * radius_m);
  return options;
}

double rigid_depth_of(double half_thickness_m) {
  return std::clamp(kRigidShare * half_thickness_m, kMinRigidDepth, kMaxRigidDepth);
}

void require_positive(double value, const char* shape, const char* field) {
  if (value > 0 && std::isfinite(value)) return;
  throw std::invalid_argument(std::string(shape) + ": " + field + " is " + std::to_string(value) +
                              ", but must be a positive length in metres");
}

/// Rejects meshes far from their origin, where rounding to single precision would merge many points.
void require_near_origin(const geometry::TriangleMesh& mesh, double spacing_m) {
  double reach_m = 0;
  for (const Vec3& vertex : mesh.vertices) reach_m = std::max(reach_m, vertex.cwiseAbs().maxCoeff());
  const double rounding_m = reach_m * 0x1.0p-24;
  if (rounding_m <= kRoundingShare * spacing_m) return;
  std::ostringstream message;
  message << std::setprecision(3) << "the mesh reaches " << reach_m
          << " m from its origin, where single precision would round its points by " << rounding_m * 1e3
          << " mm: set \"centre\": true of the mesh, or move it nearer to its origin";
  throw geometry::MeshError(message.str());
}

std::shared_ptr<ContactShape> make_primitive(std::shared_ptr<const DistanceField> field,
                                             const geometry::TriangleMesh& outline, double half_thickness_m,
                                             const ContactShapeOptions& options) {
  auto shape = std::make_shared<ContactShape>();
  shape->shells = sample_surface(outline, *field, options);
  drop_polygons_off(*field, shape->shells.surface);
  drop_polygons_off(*field, shape->shells.features);
  shape->field = std::move(field);
  shape->half_thickness_m = std::min(half_thickness_m, kMaxHalfThickness);
  shape->rigid_depth_m = rigid_depth_of(half_thickness_m);
  shape->complete();
  return shape;
}

/// Returns whether a surface point is inside a flat part of the surface, away from its edges: it is on a plane that
/// equals the field in a box around the point.
bool is_inside_of_plane(const DistanceField& field, const ShellPoint& point) {
  const std::span<const FieldPlane> planes = field.planes();
  if (planes.empty()) return false;
  const Vec3 p_S = point.p_S.cast<double>();
  const auto holds = [&](const FieldPlane& plane) {
    return std::abs(plane.distance_m(p_S)) < kOnPlane_m &&
           plane.normal.dot(point.normal_S.cast<double>()) > kOnPlaneCosine;
  };
  const auto plane = std::ranges::find_if(planes, holds);
  if (plane == planes.end()) return false;
  const OrientedBox around{p_S, Eigen::Matrix3d::Identity(), Vec3::Constant(kInsidePlane_m)};
  std::size_t queries = 0;
  return (field.planes_over(around, queries) >> static_cast<unsigned>(plane - planes.begin()) & 1U) != 0;
}

/// Samples the field along the inward normal of a surface point. Returns the depth from which the opposite surface is
/// nearer, or infinity if it exceeds `limit_m`. Walls that meet at an angle do not count as opposite.
double half_thickness_at(const DistanceField& field, const ShellPoint& point, double limit_m) {
  const int steps = 24;
  const Vec3 normal = point.normal_S.cast<double>();
  const Vec3 p = point.p_S.cast<double>();
  const auto is_opposite_at = [&](double depth_m) {
    const Vec3 gradient = field.sample(p - depth_m * normal).gradient;
    // A short gradient belongs to a crease. Only its direction is compared, because its length has no meaning there.
    const double length = gradient.norm();
    return gradient.dot(normal) < -0.5 * (length < kShortGradient ? length : 1);
  };
  // Two successive samples must have an opposite gradient, because a single sample on a crease has an arbitrary one.
  bool was_opposite = false;
  for (int i = 1; i <= steps + 1; ++i) {
    const bool is_opposite = is_opposite_at(limit_m * i / steps);
    if (is_opposite && was_opposite) {
      double low_m = limit_m * (i - 2) / steps, high_m = limit_m * (i - 1) / steps;
      // Bisection refines the result for shapes so thin that the rigid depth is at its minimum. Only why_too_thin()
      // needs that accuracy.
      while (kRigidShare * high_m < kMinRigidDepth && high_m - low_m > kThinnessError_m) {
        const double middle_m = (low_m + high_m) / 2;
        (is_opposite_at(middle_m) ? high_m : low_m) = middle_m;
      }
      return high_m;
    }
    was_opposite = is_opposite;
  }
  return std::numeric_limits<double>::infinity();
}

/// Returns the half thickness of the shape's thin parts. It is exceeded on the whole surface except for the fraction
/// kThinShare.
double thin_half_thickness(const DistanceField& field, const PointShell& shell) {
  const std::size_t most_samples = 20'000;
  const double limit_m = kMaxHalfThickness;
  std::vector<double> found;
  for (std::size_t i = 0; i < shell.points.size(); i += 1 + shell.points.size() / most_samples) {
    found.push_back(half_thickness_at(field, shell.points[i], limit_m));
  }
  if (found.empty()) return limit_m;
  const auto thin = found.begin() + static_cast<std::ptrdiff_t>(kThinShare * static_cast<double>(found.size()));
  std::nth_element(found.begin(), thin, found.end());
  return std::min(*thin, limit_m);
}

/// Combines the points of a solid and of a sheet into one shell. Points inside either of them are omitted.
PointShell joined(const DistanceField& field, const PointShell& solid, const PointShell& sheet) {
  std::vector<ShellPoint> points;
  for (const PointShell* shell : {&solid, &sheet}) {
    std::ranges::copy_if(shell->points, std::back_inserter(points), [&field](const ShellPoint& point) {
      return field.distance_m(point.p_S.cast<double>()) > -kBuriedErrors * field.error_m();
    });
  }
  return PointShell::make(std::move(points), std::max(solid.spacing_m, sheet.spacing_m));
}

/// Samples the solids of a mesh, and the sheets beside them as plates. Omits points inside the shape.
PointShells sample_parts(const geometry::ContactMesh& mesh, const DistanceField& field, bool may_overlap,
                         const ContactShapeOptions& options, const std::function<void(double)>& progress) {
  PointShells shells = sample_surface(mesh, options, progress);
  if (mesh.sheet.triangles.empty() && !may_overlap) return shells;
  PointShells sheet;
  if (!mesh.sheet.triangles.empty()) {
    sheet = sample_surface({mesh.sheet, geometry::SurfaceKind::kSheet, {}}, options, progress);
  }
  return {joined(field, shells.surface, sheet.surface), joined(field, shells.features, sheet.features)};
}

/// Combines the progress of several stages, each of which may report from 0 again, into one that never decreases.
class StagedProgress {
 public:
  explicit StagedProgress(const std::function<void(double)>& progress) : progress_(progress) {}

  std::function<void(double)> stage(double from, double to) {
    return [this, from, to](double done) { reach(from + (to - from) * done); };
  }
  void reach(double done) {
    reached_ = std::max(reached_, done);
    if (progress_) progress_(reached_);
  }

 private:
  const std::function<void(double)>& progress_;
  double reached_ = 0;
};

}  // namespace

void ContactShape::complete() {
  const auto& points = shells.surface.points;
  if (points.empty()) return;
  Eigen::Vector3f low = points.front().p_S;
  Eigen::Vector3f high = low;
  for (const ShellPoint& point : points) {
    low = low.cwiseMin(point.p_S);
    high = high.cwiseMax(point.p_S);
  }
  low_S = low.cast<double>();
  high_S = high.cast<double>();
  std::vector<ShellPoint> others;
  std::ranges::copy_if(points, std::back_inserter(others),
                       [this](const ShellPoint& point) { return !is_inside_of_plane(*field, point); });
  if (others.size() == points.size()) return;
  off_planes = PointShell::make(std::move(others), shells.surface.spacing_m);
  drop_polygons_off(*field, *off_planes);
}

std::size_t ContactShape::memory_bytes() const {
  const auto* grid = dynamic_cast<const DistanceGrid*>(field.get());
  return sizeof(*this) + shells.surface.memory_bytes() + shells.features.memory_bytes() +
         (off_planes ? off_planes->memory_bytes() : 0) +
         (grid != nullptr ? grid->memory_bytes() : sizeof(DistanceField));
}

std::shared_ptr<const ContactShape> make_contact_sphere(double radius_m, const ContactShapeOptions& options) {
  require_positive(radius_m, "sphere", "radius");
  auto shape = make_primitive(sphere_field(radius_m), geometry::tessellated_sphere(radius_m), radius_m,
                              for_radius(radius_m, options));
  shape->ball_radius_m = radius_m;
  shape->rod = {radius_m, 0, true};
  return shape;
}

std::shared_ptr<const ContactShape> make_contact_box(const Vec3& size_m, const ContactShapeOptions& options) {
  for (const double edge : size_m) require_positive(edge, "box", "an edge");
  return make_primitive(box_field(size_m), geometry::tessellated_box(size_m), size_m.minCoeff() / 2, options);
}

std::shared_ptr<const ContactShape> make_contact_cylinder(double radius_m, double length_m,
                                                          const ContactShapeOptions& options) {
  require_positive(radius_m, "cylinder", "radius");
  require_positive(length_m, "cylinder", "length");
  auto shape = make_primitive(cylinder_field(radius_m, length_m), geometry::tessellated_cylinder(radius_m, length_m),
                              std::min(radius_m, length_m / 2), for_radius(radius_m, options));
  shape->rod = {radius_m, length_m / 2, false};
  return shape;
}

std::shared_ptr<const ContactShape> make_contact_capsule(double radius_m, double length_m,
                                                         const ContactShapeOptions& options) {
  require_positive(radius_m, "capsule", "radius");
  require_positive(length_m, "capsule", "length");
  auto shape = make_primitive(capsule_field(radius_m, length_m), geometry::tessellated_capsule(radius_m, length_m),
                              radius_m, for_radius(radius_m, options));
  shape->rod = {radius_m, length_m / 2, true};
  return shape;
}

std::shared_ptr<const ContactShape> make_contact_mesh(const geometry::ContactMesh& mesh,
                                                      const ContactShapeOptions& options_in,
                                                      const std::function<void(double)>& progress) {
  require_near_origin(mesh.mesh, options_in.spacing_m);
  require_near_origin(mesh.sheet, options_in.spacing_m);
  check(options_in);
  auto shape = std::make_shared<ContactShape>();
  StagedProgress staged(progress);
  const bool is_solid = mesh.kind == geometry::SurfaceKind::kSolid;
  const auto tree = is_solid ? geometry::TriangleTree::of_solid(mesh.mesh, mesh.inner, options_in.threads)
                             : geometry::TriangleTree(mesh.mesh);
  ContactShapeOptions options = options_in;
  if (is_solid && options.refines_rods) {
    options = for_radius(thin_rod_radius_m(mesh.mesh, tree, kThinRadius_m), options);
  }
  shape->field = DistanceGrid::build(mesh, tree, options, staged.stage(0.05, 0.7));
  shape->shells = sample_parts(mesh, *shape->field, tree.may_overlap(), options, staged.stage(0.7, 0.95));
  shape->half_thickness_m = thin_half_thickness(*shape->field, shape->shells.surface);
  shape->rigid_depth_m = rigid_depth_of(shape->half_thickness_m);
  // The shape is read back from its coded bytes, so that the server and all clients have the same numbers.
  auto coded = contact_shape_from(contact_asset_bytes(*shape, 0));
  if (coded == nullptr) {
    throw geometry::MeshError(
        "it needs " + std::to_string(shape->memory_bytes() >> 20U) + " MiB as a contact shape, of which " +
        std::to_string(kMaxShapeBytes >> 20U) +
        " are possible: leave out parts that cannot be touched, or divide it among several meshes");
  }
  staged.reach(1);
  return coded;
}

}  // namespace tandem::contact

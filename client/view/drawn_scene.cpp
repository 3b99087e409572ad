#include "client/view/drawn_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "client/session/session.hpp"
#include "client/view/molecular_surface.hpp"
#include "client/view/ribbon.hpp"
#include "common/base/byte_io.hpp"
#include "common/docking/molecule_asset.hpp"
#include "common/geometry/drawing_asset.hpp"
#include "common/geometry/tessellation.hpp"
#include "proto/placement.hpp"
#include "proto/soft_shape.hpp"

namespace tandem::client {
namespace {

/// Limits for static bodies in the initial view, as multiples of the radius of the ball around tools and moving bodies.
/// A static body above one of the limits (for example a table) does not widen the view: kMaxStaticSize limits its
/// radius, kMaxStaticDistance its distance.
constexpr double kMaxStaticSize = 2.5;
constexpr double kMaxStaticDistance = 5;
constexpr double kDeskReach_m = 0.08;
/// Factor by which the focus ball is enlarged as a margin.
constexpr double kFocusMargin = 1.15;
constexpr double kDefaultToolRadius_m = 0.005;
/// Maximum number of triangles of a soft body. It is low because normals are computed again at each deformation. A
/// server sends at most about four thousand triangles.
constexpr std::size_t kMaxSoftTriangles = 8'000;
/// Maximum number of triangles of all meshes of a scene together; their vertices need 700 MB.
constexpr std::size_t kMaxSceneTriangles = 8'000'000;

Rgba rgba_of(const google::protobuf::RepeatedField<double>& rgb, const Rgba& otherwise) {
  if (rgb.size() != 3) return otherwise;
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2]), 1};
}

std::optional<geometry::TriangleMesh> tessellated(const wire::Shape& shape) {
  switch (shape.kind_case()) {
    case wire::Shape::kSphere:
      return geometry::tessellated_sphere(shape.sphere().radius_m());
    case wire::Shape::kBox:
      if (shape.box().size_m_size() != 3) return std::nullopt;
      return geometry::tessellated_box({shape.box().size_m(0), shape.box().size_m(1), shape.box().size_m(2)});
    case wire::Shape::kCylinder:
      return geometry::tessellated_cylinder(shape.cylinder().radius_m(), shape.cylinder().length_m());
    case wire::Shape::kCapsule:
      return geometry::tessellated_capsule(shape.capsule().radius_m(), shape.capsule().length_m());
    default:
      return std::nullopt;
  }
}

class Builder {
 public:
  Builder(const wire::Joined& joined, const AssetMap& assets, MoleculeStyle molecules, const std::stop_token& stop)
      : scene_(joined.scene()), offered_(joined.assets()), assets_(assets), molecules_(molecules), stop_(stop) {}

  DrawnScene build() {
    for (const wire::Body& body : scene_.bodies()) {
      const Rgba color = rgba_of(body.color_rgb(), {0.7F, 0.7F, 0.7F, 1});
      out_.bodies.push_back(drawn(body.name(), body.shapes(), body.placement(), color));
      out_.bodies.back().is_static = body.mass_kg() <= 0;
    }
    for (const wire::SoftBody& body : scene_.soft_bodies()) out_.soft_bodies.push_back(soft(body));
    for (int i = 0; i < scene_.tools_size(); ++i) out_.tools.push_back(tool(i));
    frame();
    return std::move(out_);
  }

 private:
  DrawnBody drawn(const std::string& name, const google::protobuf::RepeatedPtrField<wire::Shape>& shapes,
                  const wire::Placement& placement, const Rgba& color) {
    DrawnBody body;
    body.name = printable(name);
    body.X_WB_start = proto::pose_from_placement(placement);
    for (const wire::Shape& shape : shapes) append(body, shape, color);
    finish(body);
    return body;
  }

  DrawnBody tool(int index) {
    const wire::Tool& message = scene_.tools(index);
    const Rgba color = tool_color(static_cast<std::size_t>(index));
    DrawnBody body = drawn(message.name(), message.shapes(), message.placement(), color);
    if (!body.mesh.empty()) return body;
    append_mesh(body.mesh, geometry::tessellated_sphere(kDefaultToolRadius_m), Pose{}, color);
    finish(body);
    return body;
  }

  DrawnBody soft(const wire::SoftBody& message) {
    DrawnBody body;
    body.name = printable(message.name());
    body.X_WB_start = proto::pose_from_placement(message.placement());
    body.soft_color = rgba_of(message.color_rgb(), {0.8F, 0.5F, 0.5F, 1});
    if (message.has_block()) {
      set_soft_block(message.block(), body);
    } else if (const auto* const mesh = drawing(message.mesh(), kMaxSoftTriangles)) {
      set_soft_mesh(mesh->first, body);
    } else {
      out_.missing.push_back(body.name + ": its surface is not here");
    }
    body.mesh = drawn_soft(body, std::vector<Vec3>(proto::kSoftLatticePoints, Vec3(0, 0, 0)));
    finish(body);
    return body;
  }

  static void set_soft_block(const wire::SoftBlock& block, DrawnBody& body) {
    const auto& size_m = block.size_m();
    if (size_m.size() != 3) return;
    for (std::size_t i = 0; i < proto::kSoftLatticePoints; ++i) {
      body.soft.vertices.push_back(proto::soft_lattice()[i].cwiseProduct(Vec3(size_m[0], size_m[1], size_m[2])));
      body.soft_goes_with.push_back({{{i, 1.0}}});
    }
    for (const std::array<int, 3>& face : proto::soft_lattice_faces()) body.soft.triangles.push_back(face);
  }

  /// Finds, for each vertex, the nearest points of the body's lattice and their weights. A deformation moves a vertex
  /// by the weighted mean of the displacements of these points.
  static void set_soft_mesh(const geometry::TriangleMesh& mesh, DrawnBody& body) {
    body.soft = mesh;
    std::vector<Vec3> node_places;
    for (const proto::NearPlaces& nodes : proto::soft_lattice_nodes(mesh.vertices)) {
      Vec3 at = Vec3::Zero();
      for (const auto& [node, weight] : nodes) at += weight * mesh.vertices[node];
      node_places.push_back(at);
    }
    for (const Vec3& vertex : mesh.vertices) body.soft_goes_with.push_back(proto::places_near(vertex, node_places));
  }

  void append(DrawnBody& body, const wire::Shape& shape, const Rgba& color) {
    if (stop_.stop_requested()) return;
    const Pose X_BS = proto::pose_from_placement(shape.placement());
    if (shape.has_molecule()) return append_atoms(body, shape.molecule(), color);
    if (const auto* const drawn = shape.has_mesh() ? drawing(shape.mesh(), triangles_left_) : nullptr) {
      triangles_left_ -= drawn->first.triangles.size();
      append_mesh(body.mesh, *drawn, X_BS, color);
    } else if (const auto mesh = tessellated(shape)) {
      append_mesh(body.mesh, *mesh, X_BS, color);
    } else {
      out_.missing.push_back(body.name + ": its surface is not here");
    }
  }

  /// Returns the finest mesh received so far that has at most `most` triangles.
  const geometry::ShadedMesh* drawing(const wire::Mesh& mesh, std::size_t most) {
    const geometry::ShadedMesh* finest = nullptr;
    for (const wire::AssetInfo& info : offered_) {
      if (info.kind() != geometry::kDrawingAssetKind || info.coarse_of() != mesh.surface_sha256()) continue;
      const std::optional<geometry::ShadedMesh>& found = decoded(info.sha256());
      const std::size_t least = finest != nullptr ? finest->first.triangles.size() : 0;
      if (found && found->first.triangles.size() > least && found->first.triangles.size() <= most) finest = &*found;
    }
    return finest;
  }

  /// Returns a decoded drawing asset. Each asset is decoded once for all shapes that use it.
  const std::optional<geometry::ShadedMesh>& decoded(const std::string& sha256) {
    const auto [entry, is_new] = decoded_.try_emplace(sha256);
    if (!is_new || stop_.stop_requested()) return entry->second;
    if (const proto::Bytes* const bytes = find_asset(assets_, sha256)) entry->second = geometry::drawing_from(*bytes);
    return entry->second;
  }

  void append_atoms(DrawnBody& body, const wire::MoleculeSource& source, const Rgba& color) {
    const proto::Bytes* const bytes = find_asset(assets_, source.asset_sha256());
    auto molecule = bytes == nullptr ? std::nullopt : docking::molecule_from(*bytes);
    if (!molecule) {
      out_.missing.push_back(body.name + ": its atoms are not here");
      return;
    }
    const double scale = scene_.molecular_field().metres_per_angstrom();
    const std::vector<Rgba> colors = atom_colors(*molecule, molecules_.colors, color, chains_);
    for (LegendEntry& entry : legend_of(*molecule, molecules_.colors, color, chains_)) {
      if (entry.text == "C") entry.text += " of " + body.name;  // carbon has a different colour in each molecule
      if (!in_legend_.emplace(entry.text, entry.color).second) continue;
      if (out_.legend.size() < DrawnScene::kMaxLegend) {
        out_.legend.push_back(std::move(entry));
      } else {
        ++out_.legend_omitted;
      }
    }
    chains_ += chain_count(*molecule);
    if (molecules_.shape == MoleculeStyle::kSurface) {
      append_surface(body.mesh, *molecule, scale, colors, kMaxSurfaceTriangles, stop_);
    } else if (molecules_.shape == MoleculeStyle::kRibbon) {
      append_ribbon(body.mesh, *molecule, scale, colors, stop_);
    } else {
      const auto append_as = molecules_.shape == MoleculeStyle::kSticks ? append_sticks : append_balls;
      append_as(body.mesh, *molecule, scale, colors, stop_);
    }
    body.molecule = std::make_shared<const docking::Molecule>(std::move(*molecule));
  }

  static void finish(DrawnBody& body) {
    for (const Vertex& vertex : body.mesh) {
      const Vec3 at(vertex.position_m[0], vertex.position_m[1], vertex.position_m[2]);
      body.radius_m = std::max(body.radius_m, at.norm());
    }
  }

  /// Enlarges the focus ball until it contains the given ball.
  void hold(const Vec3& centre, double radius_m) {
    const Vec3 apart = centre - out_.focus_W;
    const double distance = apart.norm();
    if (distance + radius_m <= out_.focus_radius_m) return;
    const double wide = std::max(radius_m, (distance + radius_m + out_.focus_radius_m) / 2);
    if (distance > 0) out_.focus_W += apart / distance * std::max(0.0, wide - out_.focus_radius_m);
    out_.focus_radius_m = wide;
  }

  void frame() {
    bool has_any = false;
    const auto widen = [this, &has_any](const DrawnBody& body) {
      if (!std::exchange(has_any, true)) {
        out_.focus_W = body.X_WB_start.p;
        out_.focus_radius_m = body.radius_m;
      } else {
        hold(body.X_WB_start.p, body.radius_m);
      }
    };
    for (const DrawnBody& body : out_.tools) widen(body);
    for (const DrawnBody& body : out_.bodies) {
      if (!body.is_static) widen(body);
    }
    for (const DrawnBody& body : out_.soft_bodies) widen(body);
    const double radius_m = out_.focus_radius_m = std::max(out_.focus_radius_m, least_focus_radius_m());
    for (const DrawnBody& body : out_.bodies) {
      const double away_m = (body.X_WB_start.p - out_.focus_W).norm();
      const bool is_near = away_m < kMaxStaticDistance * radius_m && body.radius_m < kMaxStaticSize * radius_m;
      if (body.is_static && is_near) widen(body);
    }
    out_.focus_radius_m *= kFocusMargin;
    out_.floor_z_m = lowest_z_m();
  }

  /// Returns the smallest allowed focus radius: the reach of a hand on a desk, scaled to the world.
  double least_focus_radius_m() const {
    double scale = scene_.tools().empty() ? 1 : 0;
    for (const wire::Tool& tool : scene_.tools()) scale = std::max(scale, tool.workspace().position_scale());
    return kDeskReach_m * scale;
  }

  double lowest_z_m() const {
    double lowest = out_.focus_W.z() - out_.focus_radius_m;
    bool has_static = false;
    for (const DrawnBody& body : out_.bodies) {
      if (!body.is_static) continue;
      for (const Vertex& vertex : body.mesh) {
        const Vec3 at = body.X_WB_start * Vec3(vertex.position_m[0], vertex.position_m[1], vertex.position_m[2]);
        lowest = has_static ? std::min(lowest, at.z()) : at.z();
        has_static = true;
      }
    }
    return lowest;
  }

  const wire::Scene& scene_;
  const AssetInfos& offered_;
  const AssetMap& assets_;
  MoleculeStyle molecules_;
  const std::stop_token& stop_;
  std::map<std::string, std::optional<geometry::ShadedMesh>>
      decoded_;  ///< decoded drawings, by the SHA-256 of the asset
  std::size_t triangles_left_ = kMaxSceneTriangles;
  std::size_t chains_ = 0;  ///< number of chains of the molecules added so far
  std::set<std::pair<std::string, Rgba>> in_legend_;
  DrawnScene out_;
};

/// Returns the distance from `from` to the triangle along the ray, as a multiple of the length of `along`; infinity if
/// the ray misses the triangle.
double along_ray(const Vec3& from, const Vec3& along, const Vertex* corners) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::array<Vec3, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& at = corners[k].position_m;
    p.at(k) = {at[0], at[1], at[2]};
  }
  Eigen::Matrix3d columns;
  columns << p[1] - p[0], p[2] - p[0], -along;
  const Vec3 right = from - p[0];
  const double determinant = columns.determinant();
  if (determinant == 0) return kNever;
  const Vec3 crossed = columns.col(0).cross(columns.col(1));
  const double at = crossed.dot(right) / determinant;
  const double u = right.cross(columns.col(1)).dot(columns.col(2)) / determinant;
  const double v = columns.col(0).cross(right).dot(columns.col(2)) / determinant;
  return at > 0 && u >= 0 && v >= 0 && u + v <= 1 ? at : kNever;
}

}  // namespace

// Source: Okabe and Ito, "Color universal design", 2008.
Rgba tool_color(std::size_t tool) {
  constexpr std::array<Rgba, 6> kColors{{{0.00F, 0.62F, 0.45F, 1},
                                         {0.80F, 0.47F, 0.65F, 1},
                                         {0.84F, 0.37F, 0.00F, 1},
                                         {0.00F, 0.45F, 0.70F, 1},
                                         {0.90F, 0.62F, 0.00F, 1},
                                         {0.34F, 0.71F, 0.91F, 1}}};
  return kColors[tool % kColors.size()];
}

DrawnScene make_drawn_scene(const wire::Joined& joined, const AssetMap& assets, MoleculeStyle molecules,
                            const std::stop_token& stop) {
  return Builder(joined, assets, molecules, stop).build();
}

DrawnMesh drawn_soft(const DrawnBody& body, std::span<const Vec3> offsets_W) {
  DrawnMesh out;
  if (offsets_W.size() != proto::kSoftLatticePoints) return out;
  geometry::TriangleMesh now = body.soft;
  for (std::size_t i = 0; i < body.soft_goes_with.size(); ++i) {
    Vec3 offset_W = Vec3::Zero();
    for (const auto& [point, weight] : body.soft_goes_with[i]) offset_W += weight * offsets_W[point];
    now.vertices[i] += body.X_WB_start.q.conjugate() * offset_W;
  }
  append_mesh(out, now, Pose{}, body.soft_color);
  return out;
}

std::optional<std::pair<std::size_t, Vec3>> first_hit(const DrawnScene& scene, std::span<const Pose> X_WB,
                                                      const Vec3& from_W, const Vec3& along_W) {
  std::optional<std::pair<std::size_t, Vec3>> found;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(scene.bodies.size(), X_WB.size()); ++i) {
    const DrawnMesh& mesh = scene.bodies[i].mesh;
    const Vec3 from = X_WB[i].inverse() * from_W, along = X_WB[i].q.conjugate() * along_W;
    for (std::size_t corner = 0; corner + 2 < mesh.size(); corner += 3) {
      const double at = along_ray(from, along, &mesh[corner]);
      if (at >= nearest) continue;
      nearest = at;
      found.emplace(i, from + at * along);
    }
  }
  return found;
}

}  // namespace tandem::client

#include "common/geometry/surface_features.hpp"

#include <cstdint>

namespace tandem::geometry {
namespace {

/// Sharp edges, joined into polylines ("lines"). A line ends at corners, or it is a closed loop.
class SharpLines {
 public:
  SharpLines(const SurfaceTopology& surface, double angle_rad)
      : surface_(surface), turn_cosine_(std::cos(angle_rad)), starts_(surface.mesh.vertices.size() + 1, 0) {
    for (std::size_t i = 0; i < surface.edges.size(); ++i) {
      if (surface.fold_rad(surface.edges[i]) > angle_rad) sharp_.push_back(i);
    }
    for (const std::size_t i : sharp_) {
      ++starts_[static_cast<std::size_t>(surface.edges[i].a) + 1];
      ++starts_[static_cast<std::size_t>(surface.edges[i].b) + 1];
    }
    for (std::size_t v = 1; v < starts_.size(); ++v) starts_[v] += starts_[v - 1];
    at_vertex_.resize(starts_.back());
    std::vector<std::size_t> filled(starts_.begin(), starts_.end() - 1);
    for (const std::size_t i : sharp_) {
      at_vertex_[filled[static_cast<std::size_t>(surface.edges[i].a)]++] = i;
      at_vertex_[filled[static_cast<std::size_t>(surface.edges[i].b)]++] = i;
    }
    is_used_.assign(surface.edges.size(), false);
  }

  /// One edge of a line, in the direction of the line.
  struct Step {
    int from = 0;
    int to = 0;
    std::size_t edge = 0;
  };

  bool is_corner(int vertex) const {
    const auto edges = edges_at(vertex);
    if (edges.empty()) return false;
    if (edges.size() != 2) return true;
    const Vec3 u = (other_end(edges[0], vertex) - surface_.vertex(vertex)).normalized();
    const Vec3 v = (other_end(edges[1], vertex) - surface_.vertex(vertex)).normalized();
    return u.dot(v) > -turn_cosine_;
  }

  template <typename Visit>
  void visit_lines(Visit&& visit) {
    for (const bool only_from_corners : {true, false}) {
      for (const std::size_t edge : sharp_) {
        for (const int end : {surface_.edges[edge].a, surface_.edges[edge].b}) {
          if (!is_used_[edge] && (!only_from_corners || is_corner(end))) visit(walk(edge, end));
        }
      }
    }
  }

 private:
  std::span<const std::size_t> edges_at(int vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(at_vertex_).subspan(starts_[v], starts_[v + 1] - starts_[v]);
  }

  const Vec3& other_end(std::size_t edge, int vertex) const {
    const MeshEdge& e = surface_.edges[edge];
    return surface_.vertex(e.a == vertex ? e.b : e.a);
  }

  std::vector<Step> walk(std::size_t edge, int from) {
    std::vector<Step> line;
    while (true) {
      const MeshEdge& e = surface_.edges[edge];
      const int to = e.a == from ? e.b : e.a;
      line.push_back({from, to, edge});
      is_used_[edge] = true;
      if (is_corner(to)) return line;
      const auto edges = edges_at(to);
      edge = edges[0] == edge ? edges[1] : edges[0];
      if (is_used_[edge]) return line;
      from = to;
    }
  }

  const SurfaceTopology& surface_;
  double turn_cosine_;
  std::vector<std::size_t> sharp_;
  std::vector<std::size_t> starts_;     // index in at_vertex_ at which the edges of each vertex start
  std::vector<std::size_t> at_vertex_;  // sharp edges, grouped by vertex
  std::vector<bool> is_used_;
};

/// Set of samples with a minimum distance. A new sample is rejected if it is closer to an accepted one whose normal is
/// in a similar direction.
class SparseSamples {
 public:
  explicit SparseSamples(double apart_m) : apart_m_(static_cast<float>(apart_m)), grid_(apart_m) {}

  void add(const Vec3& p, const Vec3& normal) {
    const SurfaceSample sample{p.cast<float>(), normal.cast<float>()};
    if (sample.normal_S.isZero()) return;
    bool is_free = true;
    grid_.visit_near(sample.p_S, [&](std::uint32_t, const SurfaceSample& other) {
      const bool is_near = (other.p_S - sample.p_S).squaredNorm() < apart_m_ * apart_m_;
      if (is_near && other.normal_S.dot(sample.normal_S) > 0) is_free = false;
    });
    if (is_free) grid_.add(sample);
  }
  std::span<const SurfaceSample> samples() const { return grid_.samples(); }

 private:
  float apart_m_;
  SampleGrid grid_;
};

void sample_line(const SurfaceTopology& surface, std::span<const SharpLines::Step> line, double spacing_m,
                 SparseSamples& samples) {
  double length = 0;
  for (const auto& step : line) length += (surface.vertex(step.to) - surface.vertex(step.from)).norm();
  const double pieces = std::max(1.0, std::ceil(length / spacing_m));
  const double pace = length / pieces;
  double walked = 0;
  double next = 0;
  for (const auto& step : line) {
    const Vec3& from = surface.vertex(step.from);
    const Vec3 along = surface.vertex(step.to) - from;
    const double edge_length = along.norm();
    const Vec3 normal = surface.edge_normal(surface.edges[step.edge]);
    for (; next <= walked + edge_length && edge_length > 0; next += pace) {
      samples.add(from + along * ((next - walked) / edge_length), normal);
    }
    walked += edge_length;
  }
}

}  // namespace

SurfaceTopology::SurfaceTopology(const TriangleMesh& its_mesh)
    : mesh(its_mesh),
      edges(mesh_edges(its_mesh)),
      face_normals(geometry::face_normals(its_mesh)),
      vertex_normals(geometry::vertex_normals(its_mesh, face_normals)) {}

Vec3 SurfaceTopology::edge_normal(const MeshEdge& edge) const {
  Vec3 sum = face_normal(edge.left);
  if (edge.right >= 0) sum += face_normal(edge.right);
  const double length = sum.norm();
  return length > 1e-9 ? Vec3(sum / length) : Vec3(Vec3::Zero());
}

double SurfaceTopology::fold_rad(const MeshEdge& edge) const {
  if (edge.right < 0) return 0;
  const Vec3& left = face_normal(edge.left);
  const Vec3& right = face_normal(edge.right);
  const Vec3 axis = (vertex(edge.b) - vertex(edge.a)).normalized();
  return std::atan2(left.cross(right).dot(axis), left.dot(right));
}

std::vector<SurfaceSample> sharp_samples(const SurfaceTopology& surface, double angle_rad, double spacing_m) {
  SharpLines lines(surface, angle_rad);
  SparseSamples samples(0.4 * spacing_m);
  for (std::size_t v = 0; v < surface.mesh.vertices.size(); ++v) {
    if (lines.is_corner(static_cast<int>(v))) samples.add(surface.mesh.vertices[v], surface.vertex_normals[v]);
  }
  lines.visit_lines([&](const std::vector<SharpLines::Step>& line) { sample_line(surface, line, spacing_m, samples); });
  return {samples.samples().begin(), samples.samples().end()};
}

}  // namespace tandem::geometry

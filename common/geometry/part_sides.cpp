#include "common/geometry/part_sides.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/triangle_crossing.hpp"

namespace tandem::geometry {
namespace {

using Corners = std::array<Vec3, 3>;

double diagonal_m(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Vec3& corner : corners_of(mesh, t)) box.extend(corner);
  }
  return box.diagonal().norm();
}

}  // namespace

class PartSides::Cells {
 public:
  enum class Kind : std::uint8_t {
    kFace,      ///< the inside is behind the triangle, the outside in front
    kInner,     ///< the inside is on both sides
    kUncertain  ///< any other case: a query must compute the winding number
  };

  Cells(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree, const EdgesOfTriangles& edges,
        bool is_closed, int threads, std::size_t& work)
      : work_(work), mesh_(mesh), winding_(std::move(winding)), is_closed_(is_closed), size_m_(diagonal_m(mesh)) {
    const std::vector<bool> is_end = ends_of(edges);
    cells_.resize(mesh.triangles.size());
    border_.vertices = mesh.vertices;
    std::vector<int> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0);
    std::size_t seen = 0;
    std::vector<bool> is_alone(mesh.triangles.size(), false);
    visit_crossing(mesh, tree, all, kTouching * size_m_, threads, work_,
                   [&](std::size_t t, std::span<const std::size_t> others) {
                     const Corners corners = corners_of(mesh, t);
                     std::vector<Obstacle> near;
                     for (const std::size_t other : others) near.push_back({corners_of(mesh, other), 3});
                     for (std::size_t k = 0; k < 3; ++k) {
                       if (triangles_at_[edges[t][k]] != 2) near.push_back({{corners[k], corners[(k + 1) % 3]}, 2});
                       if (is_end[static_cast<std::size_t>(mesh.triangles[t][k])])
                         near.push_back({{corners[k], corners[k]}, 2});
                     }
                     is_alone[t] = is_closed_ && near.empty();
                     if (!is_alone[t]) divide(t, corners, near, t);
                     ++seen;
                     return work_ <= kMaxWork;
                   });
    for (const std::vector<int>& region : regions_by_edges(mesh, edges, is_alone)) decide(region);
    for (std::size_t t = seen; t < all.size(); ++t) add_to_border(corners_of(mesh, t), t, true);
    work = work_;
  }

  bool is_inside(const Vec3& p_S) const noexcept { return std::abs(winding_.at(p_S)) > 0.5; }

  /// Returns the kind of the cell at a point. In an open mesh, kUncertain replaces kInner. Beside a hole, the winding
  /// number passes ½ where no triangle is, so samples of kind kInner do not prove that the whole cell has the inside on
  /// both sides.
  Kind at(std::size_t triangle, const Vec3& p_S) const noexcept {
    const Corners corners = corners_of(mesh_, triangle);
    const Vec3 ab = corners[1] - corners[0], ac = corners[2] - corners[0], ap = p_S - corners[0];
    const double bb = ab.squaredNorm(), bc = ab.dot(ac), cc = ac.squaredNorm(), scale = bb * cc - bc * bc;
    double u = (cc * ab.dot(ap) - bc * ac.dot(ap)) / scale, v = (bb * ac.dot(ap) - bc * ab.dot(ap)) / scale;
    std::size_t cell = triangle;
    while (cells_[cell].first_quarter != 0) {
      cell = cells_[cell].first_quarter;
      u *= 2;
      v *= 2;
      const std::size_t quarter = u >= 1 ? 1 : v >= 1 ? 2 : u + v > 1 ? 3 : 0;
      cell += quarter;
      if (quarter == 1) u -= 1;
      if (quarter == 2) v -= 1;
      if (quarter == 3) std::tie(u, v) = std::pair(1 - u, 1 - v);
    }
    const Kind kind = cells_[cell].kind;
    return kind == Kind::kInner && !is_closed_ ? Kind::kUncertain : kind;
  }

  const TriangleMesh& border() const { return border_; }  ///< all cells, except those with the inside on both sides
  bool has_inner() const { return has_inner_; }
  int triangle_of_border(int triangle) const { return triangle_of_border_[static_cast<std::size_t>(triangle)]; }

 private:
  static constexpr double kBeside = 1e-5, kToTheRim = 0.8;
  /// Limits of cell sizes, as fractions of the mesh's diagonal:
  /// * kFinest: a cell whose samples differ is divided down to this size.
  /// * kDoubt, kDoubtful: a cell is doubtful if all its samples agree, but a winding number is within kDoubt of ½. It
  ///   is divided down to kDoubtful.
  static constexpr double kFinest = 1.0 / 128, kDoubtful = 1.0 / 16;
  static constexpr double kDoubt = 0.2;
  static constexpr std::size_t kRegionSamples = 16;  ///< number of samples in a connected region

  struct Cell {
    Kind kind = Kind::kUncertain;
    std::uint32_t first_quarter = 0;  ///< index of the first of four quarters; 0: not divided
  };
  /// Obstacle in a triangle: another triangle that touches it, or a side or corner of the triangle itself at an edge
  /// that does not have two triangles. The kind of the triangle's cells may change there.
  struct Obstacle {
    Corners corners;
    int count;
  };

  std::vector<bool> ends_of(const EdgesOfTriangles& edges) {
    triangles_at_.resize(3 * edges.size());
    for (const auto& of_triangle : edges)
      for (const std::uint32_t edge : of_triangle) ++triangles_at_[edge];
    std::vector<bool> is_end(mesh_.vertices.size(), false);
    for (std::size_t t = 0; t < edges.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (triangles_at_[edges[t][k]] == 2) continue;
        for (const std::size_t end : {k, (k + 1) % 3}) is_end[static_cast<std::size_t>(mesh_.triangles[t][end])] = true;
      }
    }
    return is_end;
  }

  /// Classifies a connected region that meets no other triangle, by a few samples. If the samples differ, the region's
  /// triangles are divided into cells.
  void decide(const std::vector<int>& region) {
    std::array<bool, 3> is_found{};
    Kind kind = Kind::kUncertain;
    for (std::size_t i = 0; i < region.size() && work_ <= kMaxWork; i += 1 + region.size() / kRegionSamples) {
      kind = sample_cell(corners_of(mesh_, static_cast<std::size_t>(region[i])), true).kind;
      is_found[static_cast<std::size_t>(kind)] = true;
      work_ += kWorkPerSample;
    }
    const bool is_one = std::ranges::count(is_found, true) == 1;
    for (const int triangle : region) {
      const auto t = static_cast<std::size_t>(triangle);
      const Corners corners = corners_of(mesh_, t);
      if (!is_one && work_ <= kMaxWork) {
        divide(t, corners, {}, t);
        continue;
      }
      cells_[t].kind = is_one ? kind : Kind::kUncertain;
      has_inner_ = has_inner_ || cells_[t].kind == Kind::kInner;
      if (cells_[t].kind != Kind::kInner) add_to_border(corners, t, true);
    }
  }

  void divide(std::size_t cell, const Corners& corners, std::span<const Obstacle> near, std::size_t triangle) {
    const double tolerance_m = kTouching * size_m_;
    std::vector<Obstacle> left;
    for (const Obstacle& other : near) {
      const bool touches = other.count == 3 ? meet(corners, other.corners, tolerance_m)
                                            : meets(corners, other.corners[0], other.corners[1], tolerance_m);
      if (touches) left.push_back(other);
    }
    const auto& [a, b, c] = corners;
    const double share = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}) / size_m_;
    CellSample sample;
    work_ += kWorkPerMeeting * near.size() + kWorkPerSample;
    if (left.empty() || share <= kFinest)
      sample = sample_cell(corners, left.empty() && (is_closed_ || share <= kDoubtful));
    const bool is_unclear = !left.empty() || sample.is_mixed;
    if (share > (is_unclear ? kFinest : sample.is_doubtful ? kDoubtful : share) && work_ <= kMaxWork) {
      const std::size_t first = cells_.size();
      cells_[cell].first_quarter = static_cast<std::uint32_t>(first);
      cells_.resize(first + 4);
      const Vec3 ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
      const Corners quarters[] = {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {bc, ca, ab}};
      for (std::size_t k = 0; k < 4; ++k) divide(first + k, quarters[k], left, triangle);
      return;
    }
    cells_[cell].kind = is_unclear || (sample.is_doubtful && !is_closed_) ? Kind::kUncertain : sample.kind;
    if (sample.kind == Kind::kInner && !sample.is_mixed) {
      has_inner_ = true;
    } else {
      add_to_border(corners, triangle, cell == triangle);
    }
  }

  /// Result of the samples in one cell.
  struct CellSample {
    Kind kind = Kind::kUncertain;
    bool is_mixed = false;     ///< samples in the cell have different kinds
    bool is_doubtful = false;  ///< a winding number is close to ½ and may cross ½ elsewhere in the cell
  };

  /// Classifies a cell by samples: at its middle, then near its corners and the middles of its sides. If
  /// `at_middle_only` is set and the first result is clear, the others are omitted.
  CellSample sample_cell(const Corners& corners, bool at_middle_only) const {
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
    const Vec3 step = kBeside * size_m_ * normal;
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    CellSample sample;
    const auto kind_at = [&](const Vec3& p_S) {
      const double behind = std::abs(winding_.at(p_S - step)) - 0.5, before = std::abs(winding_.at(p_S + step)) - 0.5;
      sample.is_doubtful = sample.is_doubtful || std::min(std::abs(behind), std::abs(before)) < kDoubt;
      return behind <= 0 ? Kind::kUncertain : before > 0 ? Kind::kInner : Kind::kFace;
    };
    sample.kind = kind_at(middle);
    if (at_middle_only && (is_closed_ || !sample.is_doubtful)) return sample;
    for (std::size_t k = 0; k < 3 && !sample.is_mixed; ++k) {
      const Vec3 side = (corners[k] + corners[(k + 1) % 3]) / 2;
      sample.is_mixed = kind_at(middle + kToTheRim * (corners[k] - middle)) != sample.kind ||
                        kind_at(middle + kToTheRim * (side - middle)) != sample.kind;
    }
    return sample;
  }

  void add_to_border(const Corners& corners, std::size_t triangle, bool is_whole) {
    if (is_whole) {
      border_.triangles.push_back(mesh_.triangles[triangle]);
    } else {
      const auto first = static_cast<int>(border_.vertices.size());
      border_.vertices.insert(border_.vertices.end(), corners.begin(), corners.end());
      border_.triangles.push_back({first, first + 1, first + 2});
    }
    triangle_of_border_.push_back(static_cast<int>(triangle));
  }

  std::size_t work_;
  const TriangleMesh& mesh_;
  WindingNumber winding_;
  bool is_closed_;
  double size_m_;
  std::vector<int> triangles_at_;  ///< number of triangles at each edge
  std::vector<Cell> cells_;        ///< one cell for each triangle, followed by the quarters of divided cells
  bool has_inner_ = false;
  TriangleMesh border_;
  std::vector<int> triangle_of_border_;
};

PartSides::PartSides(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree,
                     const EdgesOfTriangles& edges, bool is_closed, int threads, std::size_t& work)
    : cells_(std::make_unique<const Cells>(mesh, std::move(winding), tree, edges, is_closed, threads, work)) {}

PartSides::~PartSides() = default;

bool PartSides::is_face(int triangle, const Vec3& at_S) const noexcept {
  return cells_->at(static_cast<std::size_t>(triangle), at_S) == Cells::Kind::kFace;
}

bool PartSides::is_inside(const Vec3& p_S, int triangle, const Vec3& closest_S) const noexcept {
  const Cells::Kind kind = cells_->at(static_cast<std::size_t>(triangle), closest_S);
  return kind == Cells::Kind::kInner || cells_->is_inside(p_S);
}

const TriangleMesh& PartSides::border() const {
  return cells_->border();
}

bool PartSides::has_inner() const {
  return cells_->has_inner();
}

int PartSides::triangle_of_border(int triangle) const {
  return cells_->triangle_of_border(triangle);
}

}  // namespace tandem::geometry

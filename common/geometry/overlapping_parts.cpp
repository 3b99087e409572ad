// The union of solids that overlap, of which a mesh from a modelling program often is: bristles that stand in a board, a handle that
// goes into a pot. What is of one part is inside of another there, and no surface.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_crossing.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

using Box = Eigen::AlignedBox3d;

using Corners = std::array<Vec3, 3>;
using EdgesOfTriangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr std::size_t kMaxSlabs = 256;
/// Of the diagonal: what is nearer to each other touches.
constexpr double kTouching = 1e-7;
/// Pairs of triangles that are compared, of one mesh; a look at the winding number is worth some of them. Some seconds.
constexpr std::size_t kMaxWork = 10'000'000, kWorkPerLook = 100;
constexpr double kMaxEdges = 300;  ///< squared, of the diagonal's: of longer ones the winding number looks at each

/// A part of a mesh: its box, the volume that it encloses, and its triangles.
struct Piece {
  Box box;
  double volume_m3 = 0, edges_m2 = 0;
  bool is_closed = true, crosses_itself = false;
  std::vector<int> triangles;

  bool is_simple() const { return is_closed && !crosses_itself; }

  void add(const Piece& other) {
    box.extend(other.box);
    triangles.insert(triangles.end(), other.triangles.begin(), other.triangles.end());
  }
};

std::vector<Piece> pieces_of(const TriangleMesh& mesh, const EdgesOfTriangles& edges) {
  const std::vector<std::size_t> part_of = parts_by_vertices(mesh);
  std::vector<Piece> pieces(*std::ranges::max_element(part_of) + 1);
  std::vector<int> triangles_at(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    Piece& piece = pieces[part_of[i]];
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])];
      piece.box.extend(corners[k]);
    }
    piece.edges_m2 += (corners[1] - corners[0]).squaredNorm();
    piece.volume_m3 += corners[0].dot(corners[1].cross(corners[2])) / 6;
    piece.triangles.push_back(static_cast<int>(i));
    for (const std::uint32_t edge : edges[i]) ++triangles_at[edge];
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const bool is_closed = std::ranges::all_of(edges[i], [&](std::uint32_t edge) { return triangles_at[edge] == 2; });
    pieces[part_of[i]].is_closed = pieces[part_of[i]].is_closed && is_closed;
  }
  return pieces;
}

/// Each with its cavities. Pieces that are only closed together are one.
std::vector<Piece> solids_of(const std::vector<Piece>& pieces) {
  std::vector<Piece> solids;
  Piece rest;
  for (const Piece& piece : pieces) {
    if (!piece.is_closed) rest.add(piece);
    if (piece.is_closed && piece.volume_m3 > 0) solids.push_back(piece);
  }
  const std::vector<Piece> hulls = solids;
  for (const Piece& piece : pieces) {
    if (!piece.is_closed || piece.volume_m3 > 0) continue;
    std::size_t around = hulls.size();
    for (std::size_t i = 0; i < hulls.size(); ++i) {
      const bool is_smaller = around == hulls.size() || hulls[i].box.volume() < hulls[around].box.volume();
      if (hulls[i].box.contains(piece.box) && is_smaller) around = i;
    }
    if (around < hulls.size()) solids[around].add(piece);
  }
  rest.is_closed = false;
  if (!rest.triangles.empty()) solids.push_back(std::move(rest));
  return solids;
}

void find_self_crossing(std::vector<Piece>& solids, const TriangleMesh& mesh, const TriangleTree& tree,
                        std::size_t& work) {
  Box all;
  std::vector<const Piece*> solid_of(mesh.triangles.size(), nullptr);
  for (const Piece& solid : solids) {
    all.extend(solid.box);
    for (const int triangle : solid.triangles) solid_of[static_cast<std::size_t>(triangle)] = &solid;
  }
  const double tolerance_m = kTouching * all.diagonal().norm();
  std::vector<TriangleTree::Near> near;
  for (Piece& solid : solids) {
    if (!solid.is_closed || solid.edges_m2 > kMaxEdges * solid.box.diagonal().squaredNorm()) continue;
    for (const int triangle : solid.triangles) {
      for (const std::size_t other : crossing(mesh, tree, static_cast<std::size_t>(triangle), tolerance_m, near, work))
        solid.crosses_itself = solid.crosses_itself || solid_of[other] == &solid;
      if (solid.crosses_itself || work > kMaxWork) break;
    }
  }
}

/// Those of which the box meets another's, and those that are not simple.
std::vector<Piece> not_alone(std::vector<Piece> solids) {
  std::ranges::sort(solids, {}, [](const Piece& solid) { return solid.box.min().x(); });
  std::vector<bool> overlaps(solids.size(), false);
  for (std::size_t i = 0; i < solids.size(); ++i) overlaps[i] = !solids[i].is_simple();
  for (std::size_t i = 0; i < solids.size(); ++i) {
    for (std::size_t k = i + 1; k < solids.size() && solids[k].box.min().x() <= solids[i].box.max().x(); ++k) {
      if (solids[i].box.intersects(solids[k].box)) overlaps[i] = overlaps[k] = true;
    }
  }
  std::vector<Piece> found;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (overlaps[i]) found.push_back(std::move(solids[i]));
  }
  return found;
}

/// Makes meshes of pieces of one.
class Cutter {
 public:
  explicit Cutter(const TriangleMesh& mesh) : mesh_(mesh), vertex_of_(mesh.vertices.size(), -1) {}

  TriangleMesh cut(const Piece& piece) {
    TriangleMesh part;
    for (const int triangle : piece.triangles) {
      std::array<int, 3> corners = mesh_.triangles[static_cast<std::size_t>(triangle)];
      for (int& corner : corners) corner = vertex(corner, part);
      part.triangles.push_back(corners);
    }
    for (const int used : used_) vertex_of_[static_cast<std::size_t>(used)] = -1;
    used_.clear();
    return part;
  }

 private:
  int vertex(int of_mesh, TriangleMesh& part) {
    int& vertex = vertex_of_[static_cast<std::size_t>(of_mesh)];
    if (vertex < 0) {
      vertex = static_cast<int>(part.vertices.size());
      part.vertices.push_back(mesh_.vertices[static_cast<std::size_t>(of_mesh)]);
      used_.push_back(of_mesh);
    }
    return vertex;
  }

  const TriangleMesh& mesh_;
  std::vector<int> vertex_of_;  ///< of the part; −1: none
  std::vector<int> used_;
};

double signed_m(const TriangleTree::Closest& closest, const Vec3& p_S) {
  return (p_S - closest.point_S).dot(closest.normal_S) < 0 ? -closest.distance_m : closest.distance_m;
}

/// What is on the sides of the triangles of a mesh, everywhere on them. Where they meet others or have edges that do not pair up,
/// they are divided until little is left of them that may be one thing or the other.
class Sides {
 public:
  enum class Kind : std::uint8_t {
    kFace,   ///< inside behind it, outside before it
    kInner,  ///< inside on both sides
    kAsk     ///< another, or more than one
  };

  /// In      winding  of the mesh, with what of it is inside and left out
  Sides(const TriangleMesh& mesh, WindingNumber winding, const TriangleTree& tree, const EdgesOfTriangles& edges,
        const Piece& piece, std::size_t& work)
      : work_(work),
        mesh_(mesh),
        winding_(std::move(winding)),
        is_closed_(piece.is_closed),
        size_m_(piece.box.diagonal().norm()) {
    std::vector<TriangleTree::Near> space;
    const std::vector<bool> is_end = ends_of(edges);
    cells_.resize(mesh.triangles.size());
    border_.vertices = mesh.vertices;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Corners corners = corners_of(mesh, t);
      std::vector<Obstacle> near;
      if (work_ > kMaxWork) {
        add_to_border(corners, t, true);
        continue;
      }
      for (const std::size_t other : crossing(mesh, tree, t, kTouching * size_m_, space, work_))
        near.push_back({corners_of(mesh, other), 3});
      for (std::size_t k = 0; k < 3; ++k) {
        if (triangles_at_[edges[t][k]] != 2) near.push_back({{corners[k], corners[(k + 1) % 3]}, 2});
        if (is_end[static_cast<std::size_t>(mesh.triangles[t][k])]) near.push_back({{corners[k], corners[k]}, 2});
      }
      divide(t, corners, near, t);
    }
    work = work_;
  }

  bool is_inside(const Vec3& p_S) const noexcept { return std::abs(winding_.at(p_S)) > 0.5; }

  /// Around a hole, what is inside has no border of triangles.
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
    return kind == Kind::kInner && !is_closed_ ? Kind::kAsk : kind;
  }

  const TriangleMesh& border() const { return border_; }  ///< what has not the inside on both sides
  bool has_inner() const { return has_inner_; }
  int triangle_of_border(int triangle) const { return triangle_of_border_[static_cast<std::size_t>(triangle)]; }

 private:
  static constexpr double kBeside = 1e-5, kToTheRim = 0.8;
  /// Of the whole: cells that are not longer stay as they are, and likewise those where the winding number is that near to ½.
  static constexpr double kFinest = 1.0 / 128, kDoubtful = 1.0 / 16;
  static constexpr double kDoubt = 0.2;

  struct Cell {
    Kind kind = Kind::kAsk;
    std::uint32_t first_quarter = 0;  ///< 0: not divided
  };
  /// What may be a border between one kind and another: a triangle, or a side of one.
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
    Look look;
    work_ += near.size() + kWorkPerLook;
    if (left.empty() || share <= kFinest) look = look_at(corners, left.empty() && (is_closed_ || share <= kDoubtful));
    const bool is_unclear = !left.empty() || look.is_mixed;
    if (share > (is_unclear ? kFinest : look.is_doubtful ? kDoubtful : share) && work_ <= kMaxWork) {
      const std::size_t first = cells_.size();
      cells_[cell].first_quarter = static_cast<std::uint32_t>(first);
      cells_.resize(first + 4);
      const Vec3 ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
      const Corners quarters[] = {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {bc, ca, ab}};
      for (std::size_t k = 0; k < 4; ++k) divide(first + k, quarters[k], left, triangle);
      return;
    }
    cells_[cell].kind = is_unclear || (look.is_doubtful && !is_closed_) ? Kind::kAsk : look.kind;
    if (look.kind == Kind::kInner && !look.is_mixed) {
      has_inner_ = true;
    } else {
      add_to_border(corners, triangle, cell == triangle);
    }
  }

  /// What samples of a cell say.
  struct Look {
    Kind kind = Kind::kAsk;
    bool is_mixed = false;     ///< they differ
    bool is_doubtful = false;  ///< they might elsewhere: beside a hole the winding number changes
  };

  /// At its middle, and near its corners and the middles of its sides.
  Look look_at(const Corners& corners, bool at_middle_only) const {
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
    const Vec3 step = kBeside * size_m_ * normal;
    const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
    Look look;
    const auto kind_at = [&](const Vec3& p_S) {
      const double behind = std::abs(winding_.at(p_S - step)) - 0.5, before = std::abs(winding_.at(p_S + step)) - 0.5;
      look.is_doubtful = look.is_doubtful || std::min(std::abs(behind), std::abs(before)) < kDoubt;
      return behind <= 0 ? Kind::kAsk : before > 0 ? Kind::kInner : Kind::kFace;
    };
    look.kind = kind_at(middle);
    if (at_middle_only && (is_closed_ || !look.is_doubtful)) return look;
    for (std::size_t k = 0; k < 3 && !look.is_mixed; ++k) {
      const Vec3 side = (corners[k] + corners[(k + 1) % 3]) / 2;
      look.is_mixed = kind_at(middle + kToTheRim * (corners[k] - middle)) != look.kind ||
                      kind_at(middle + kToTheRim * (side - middle)) != look.kind;
    }
    return look;
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
  std::vector<int> triangles_at_;  ///< each edge
  std::vector<Cell> cells_;        ///< first one of each triangle
  bool has_inner_ = false;
  TriangleMesh border_;
  std::vector<int> triangle_of_border_;
};

}  // namespace

/// Slabs across the longest axis say which parts a point may be in.
struct TriangleTree::Parts {
  struct Part {
    Part(const Piece& piece, TriangleMesh of_piece, const TriangleMesh& inner, std::size_t& work)
        : box(piece.box), mesh(std::move(of_piece)), tree(mesh), triangles(piece.triangles) {
      if (piece.is_simple()) {
        find_bounds();
        return;
      }
      WindingNumber winding = piece.is_closed ? WindingNumber(mesh) : WindingNumber(joined(mesh, inner));
      sides.emplace(mesh, std::move(winding), tree, edges_of(tree), piece, work);
      if (sides->has_inner() && !sides->border().triangles.empty()) border.emplace(sides->border());
    }

    /// Where the faces at an edge do not pair up, or cross others, the nearest one does not say which side is inside.
    ///
    /// In      found  the closest point, if that is known, or none
    /// Out     none if it is not within the limit
    Closest closest(const Vec3& p_S, double limit_m, Closest found) const {
      if (found.triangle < 0) found = tree.closest(p_S, limit_m);
      if (found.triangle < 0) return found;
      const Sides::Kind kind = kind_of(found.triangle, found.point_S);
      if (kind == Sides::Kind::kFace) return found;
      const bool is_inside = kind == Sides::Kind::kInner || sides->is_inside(p_S);
      if (is_inside && border) {
        found = border->closest(p_S);
        found.triangle = sides->triangle_of_border(found.triangle);
      }
      face(found, p_S, is_inside);
      return found;
    }
    /// As a box around it says; less than 0 outside of that.
    double max_depth_m(const Vec3& p_S) const {
      if (!box.contains(p_S)) return -1;
      if (sides) return std::numeric_limits<double>::infinity();
      const Vec3 p_U = R_US * p_S;
      return std::min((p_U - box_U.min()).minCoeff(), (box_U.max() - p_U).minCoeff());
    }
    void find_bounds();
    Sides::Kind kind_of(int triangle, const Vec3& p_S) const {
      return sides ? sides->at(static_cast<std::size_t>(triangle), p_S) : Sides::Kind::kFace;
    }
    /// Turns the normal so that it says so.
    static void face(Closest& found, const Vec3& p_S, bool is_inside) {
      if ((signed_m(found, p_S) < 0) == is_inside || !(found.distance_m > 0)) return;
      found.normal_S = (is_inside ? -1 : 1) * (p_S - found.point_S) / found.distance_m;
    }

    Box box;
    Eigen::Matrix3d R_US;  ///< of a simple part: to a box along its axes, in which a needle fits tightly
    Box box_U;
    TriangleMesh mesh;
    TriangleTree tree;
    std::vector<int> triangles;          ///< of the mesh that it is a part of, in the order of its own
    std::optional<Sides> sides;          ///< of what is not simple
    std::optional<TriangleTree> border;  ///< of that, where it has inner faces
  };

  Parts(const TriangleMesh& mesh, const TriangleMesh& inner, const std::vector<Piece>& pieces, std::size_t work)
      : places(mesh.triangles.size(), {kNone, 0}) {
    Cutter cutter(mesh);
    for (const Piece& piece : pieces) {
      all.extend(piece.box);
      for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
        places[static_cast<std::size_t>(piece.triangles[i])] = {static_cast<std::uint32_t>(parts.size()),
                                                                static_cast<int>(i)};
      }
      parts.push_back(std::make_unique<Part>(piece, cutter.cut(piece), inner, work));
    }
    all.sizes().maxCoeff(&axis);
    slabs.resize(std::min(kMaxSlabs, 2 * parts.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::size_t last = slab_of(parts[i]->box.max());
      for (std::size_t k = slab_of(parts[i]->box.min()); k <= last; ++k) slabs[k].push_back(i);
    }
  }

  /// Its normal there says which side is inside.
  bool is_face(int triangle, const Vec3& p_S) const {
    const auto& [part, in_part] = places[static_cast<std::size_t>(triangle)];
    return part == kNone || parts[part]->kind_of(in_part, p_S) == Sides::Kind::kFace;
  }
  std::size_t slab_of(const Vec3& p_S) const {
    const double share = (p_S[axis] - all.min()[axis]) / all.sizes()[axis];
    return std::min(static_cast<std::size_t>(share * static_cast<double>(slabs.size())), slabs.size() - 1);
  }

  Box all;
  Eigen::Index axis = 0;
  std::vector<std::unique_ptr<Part>> parts;
  static constexpr std::uint32_t kNone = ~0U;
  std::vector<std::pair<std::uint32_t, int>> places;  ///< of each triangle of the mesh: its part, and which it is there
  std::vector<std::vector<std::size_t>> slabs;

  static EdgesOfTriangles edges_of(const TriangleTree& tree) {
    EdgesOfTriangles edges(tree.triangle_count());
    for (std::size_t slot = 0; slot < edges.size(); ++slot)
      edges[tree.triangle_of_slot_[slot]] = tree.edges_of_slot_[slot];
    return edges;
  }
};

void TriangleTree::Parts::Part::find_bounds() {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& vertex : mesh.vertices) spread += (vertex - box.center()) * (vertex - box.center()).transpose();
  R_US = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().transpose();
  const Vec3 rounding_m = Vec3::Constant(kTouching * box.diagonal().norm());
  for (const Vec3& vertex : mesh.vertices) box_U.extend(Box(R_US * vertex - rounding_m, R_US * vertex + rounding_m));
}

void TriangleTree::find_parts(const TriangleMesh& mesh, const TriangleMesh& inner) {
  std::vector<Piece> solids = solids_of(pieces_of(mesh, Parts::edges_of(*this)));
  std::size_t work = 0;
  find_self_crossing(solids, mesh, *this, work);
  const std::vector<Piece> found = not_alone(std::move(solids));
  if (!found.empty()) parts_ = std::make_shared<Parts>(mesh, inner, found, work);
}

TriangleTree TriangleTree::of_solid(const TriangleMesh& mesh, const TriangleMesh& inner) {
  TriangleTree tree(mesh);
  tree.find_parts(mesh, inner);
  return tree;
}

TriangleTree::Closest TriangleTree::closest_of_solid(const Vec3& p_S, double limit_m, int hint) const noexcept {
  const Closest nearest = closest(p_S, limit_m, hint);
  if (parts_ == nullptr || nearest.triangle < 0) return nearest;
  Closest best = nearest;
  const auto& [part_of_nearest, nearest_in_part] = parts_->places[static_cast<std::size_t>(nearest.triangle)];
  double deepest_m = 0;
  for (const std::size_t i : parts_->slabs[parts_->all.contains(p_S) ? parts_->slab_of(p_S) : 0]) {
    const Parts::Part& part = *parts_->parts[i];
    // What is inside is as deep as the nearest surface at least.
    const double max_depth_m = part.max_depth_m(p_S);
    if (max_depth_m < std::max(nearest.distance_m, -deepest_m)) continue;
    Closest closest = i == part_of_nearest ? nearest : Closest{};
    if (i == part_of_nearest) closest.triangle = nearest_in_part;
    closest = part.closest(p_S, max_depth_m, closest);
    const double signed_distance_m = closest.triangle < 0 ? 0 : signed_m(closest, p_S);
    if (signed_distance_m >= deepest_m) continue;
    deepest_m = signed_distance_m;
    closest.triangle = part.triangles[static_cast<std::size_t>(closest.triangle)];
    best = closest;
  }
  if (!(best.distance_m < limit_m)) return {};
  if (deepest_m == 0 && !parts_->is_face(best.triangle, best.point_S)) Parts::Part::face(best, p_S, false);
  return best;
}

double TriangleTree::signed_distance_m(const Vec3& p_S) const noexcept {
  return signed_m(closest_of_solid(p_S), p_S);
}

}  // namespace tandem::geometry

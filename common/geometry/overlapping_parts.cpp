// Distance to the union of overlapping solids. Meshes from modelling programs often consist of such solids, for example
// bristles in a board or a handle on a pot. Surface that is inside another solid does not belong to the surface of the
// union.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/part_sides.hpp"
#include "common/geometry/triangle_crossing.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr std::size_t kMaxSlabs = 256;
/// Largest sum of a solid's squared edge lengths, as a multiple of the squared diagonal of its box. A solid above this
/// limit is not searched for triangles that cross each other, because queries of its winding number would be slow.
constexpr double kMaxEdges = 300;

/// A part of a mesh, with its bounding box, enclosed volume and triangles.
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

/// Groups pieces into solids: each closed piece together with its cavities, and all open pieces together as one solid.
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

void find_self_crossing(std::vector<Piece>& solids, const TriangleMesh& mesh, const TriangleTree& tree, int threads,
                        std::size_t& work) {
  Box all;
  std::vector<std::size_t> solid_of(mesh.triangles.size(), solids.size());
  for (std::size_t i = 0; i < solids.size(); ++i) {
    all.extend(solids[i].box);
    for (const int triangle : solids[i].triangles) solid_of[static_cast<std::size_t>(triangle)] = i;
  }
  const double tolerance_m = kTouching * all.diagonal().norm();
  for (std::size_t i = 0; i < solids.size(); ++i) {
    Piece& solid = solids[i];
    if (!solid.is_closed || solid.edges_m2 > kMaxEdges * solid.box.diagonal().squaredNorm()) continue;
    if (work > kMaxWork) break;
    // The search begins with the last triangles. Repair has added these to close holes, so they are the most likely
    // ones to cross others.
    const std::vector<int> backwards(solid.triangles.rbegin(), solid.triangles.rend());
    visit_crossing(
        mesh, tree, backwards, tolerance_m, threads, work, [&](std::size_t, std::span<const std::size_t> others) {
          solid.crosses_itself = std::ranges::any_of(others, [&](std::size_t other) { return solid_of[other] == i; });
          return !solid.crosses_itself && work <= kMaxWork;
        });
  }
}

/// Returns the solids that may overlap. A solid may overlap if its bounding box intersects another one, if its
/// triangles cross each other, or if it has unpaired edges.
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

double signed_m(const TriangleTree::Closest& closest, const Vec3& p_S) {
  return (p_S - closest.point_S).dot(closest.normal_S) < 0 ? -closest.distance_m : closest.distance_m;
}

}  // namespace

/// Parts of the mesh that may overlap. The bounding box is divided into slabs along its longest axis. Each slab lists
/// the parts that intersect it.
struct TriangleTree::Parts {
  struct Part {
    /// In      whole  search tree of the whole mesh
    Part(const Piece& piece, const TriangleMesh& of_whole, const TriangleTree& whole, const TriangleMesh& inner,
         int threads, std::size_t& work)
        : box(piece.box), mesh(part_of(of_whole, piece.triangles)), triangles(piece.triangles) {
      const bool is_whole = triangles.size() == whole.triangle_count() && std::ranges::is_sorted(triangles);
      if (!is_whole) tree.emplace(mesh);
      if (piece.is_simple()) {
        find_bounds();
        return;
      }
      WindingNumber winding = piece.is_closed ? WindingNumber(mesh) : WindingNumber(joined(mesh, inner));
      const TriangleTree& of_part = is_whole ? whole : *tree;
      sides.emplace(mesh, std::move(winding), of_part, edges_of(of_part), piece.is_closed, threads, work);
      if (sides->has_inner() && !sides->border().triangles.empty()) border.emplace(sides->border());
    }

    /// Returns the closest point of the part, with a normal that points outwards. If the closest triangle crosses
    /// others or has unpaired edges, its own normal may point inwards and is corrected.
    ///
    /// In      found  closest point if it is already known, otherwise an empty result
    /// Out     an empty result if there is no point within the limit
    Closest closest(const Vec3& p_S, double limit_m, Closest found) const {
      if (found.triangle < 0 && tree) found = tree->closest(p_S, limit_m);
      if (found.triangle < 0 || is_face(found.triangle, found.point_S)) return found;
      const bool is_inside = sides->is_inside(p_S, found.triangle, found.point_S);
      if (is_inside && border) {
        found = border->closest(p_S);
        found.triangle = sides->triangle_of_border(found.triangle);
      }
      face(found, p_S, is_inside);
      return found;
    }
    /// Returns an upper bound of the depth of a point in this part: the depth of the point in the bounding box;
    /// negative outside the box.
    double max_depth_m(const Vec3& p_S) const {
      if (!box.contains(p_S)) return -1;
      if (sides) return std::numeric_limits<double>::infinity();
      const Vec3 p_U = R_US * p_S;
      return std::min((p_U - box_U.min()).minCoeff(), (box_U.max() - p_U).minCoeff());
    }
    void find_bounds();
    bool is_face(int triangle, const Vec3& at_S) const { return !sides || sides->is_face(triangle, at_S); }
    /// Reverses the normal if it contradicts `is_inside`, that is, if it puts the point `p_S` on the wrong side.
    static void face(Closest& found, const Vec3& p_S, bool is_inside) {
      if ((signed_m(found, p_S) < 0) == is_inside || !(found.distance_m > 0)) return;
      found.normal_S = (is_inside ? -1 : 1) * (p_S - found.point_S) / found.distance_m;
    }

    Box box;
    /// Rotation to the principal axes of a simple part. Even for a needle, the bounding box along these axes is tight.
    Eigen::Matrix3d R_US;
    Box box_U;
    TriangleMesh mesh;
    std::optional<TriangleTree> tree;    ///< search tree of the part; empty if the part is the whole mesh
    std::vector<int> triangles;          ///< index in the whole mesh of each triangle of the part
    std::optional<PartSides> sides;      ///< sides of the triangles, for a part that is not simple
    std::optional<TriangleTree> border;  ///< tree of `sides->border()`, if some triangles are inside the part
  };

  Parts(const TriangleMesh& mesh, const TriangleTree& tree, const TriangleMesh& inner, const std::vector<Piece>& pieces,
        int threads, std::size_t work)
      : places(mesh.triangles.size(), {kNone, 0}) {
    for (const Piece& piece : pieces) {
      all.extend(piece.box);
      for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
        places[static_cast<std::size_t>(piece.triangles[i])] = {static_cast<std::uint32_t>(parts.size()),
                                                                static_cast<int>(i)};
      }
      parts.push_back(std::make_unique<Part>(piece, mesh, tree, inner, threads, work));
    }
    all.sizes().maxCoeff(&axis);
    slabs.resize(std::min(kMaxSlabs, 2 * parts.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::size_t last = slab_of(parts[i]->box.max());
      for (std::size_t k = slab_of(parts[i]->box.min()); k <= last; ++k) slabs[k].push_back(i);
    }
  }

  /// Returns whether the inside is behind the triangle at this point, so that the triangle's normal can be used.
  bool is_face(int triangle, const Vec3& p_S) const {
    const auto& [part, in_part] = places[static_cast<std::size_t>(triangle)];
    return part == kNone || parts[part]->is_face(in_part, p_S);
  }
  std::size_t slab_of(const Vec3& p_S) const {
    const double share = (p_S[axis] - all.min()[axis]) / all.sizes()[axis];
    return std::min(static_cast<std::size_t>(share * static_cast<double>(slabs.size())), slabs.size() - 1);
  }

  Box all;
  Eigen::Index axis = 0;
  std::vector<std::unique_ptr<Part>> parts;
  static constexpr std::uint32_t kNone = ~0U;
  /// For each triangle of the mesh: the number of its part, and its index in that part.
  std::vector<std::pair<std::uint32_t, int>> places;
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

void TriangleTree::find_parts(const TriangleMesh& mesh, const TriangleMesh& inner, int threads) {
  std::vector<Piece> solids = solids_of(pieces_of(mesh, Parts::edges_of(*this)));
  std::size_t work = 0;
  find_self_crossing(solids, mesh, *this, threads, work);
  const std::vector<Piece> found = not_alone(std::move(solids));
  if (!found.empty()) parts_ = std::make_shared<Parts>(mesh, *this, inner, found, threads, work);
}

TriangleTree TriangleTree::of_solid(const TriangleMesh& mesh, const TriangleMesh& inner, int threads) {
  TriangleTree tree(mesh);
  tree.find_parts(mesh, inner, threads);
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
    // A part cannot contain the deepest point if its upper bound of the depth is too small: below the depth found so
    // far, or below the distance to the nearest surface.
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

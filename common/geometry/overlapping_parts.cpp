// The union of solids that overlap, of which a mesh from a modelling program often is: bristles that stand in a board, a handle that
// goes into a pot. What is of one part is inside of another there, and no surface.
#include <algorithm>
#include <functional>
#include <numeric>
#include <optional>

#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/triangle_tree.hpp"
#include "common/geometry/winding_number.hpp"

namespace tandem::geometry {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr std::size_t kMaxSlabs = 256;

/// A part of a mesh: its box, the volume that it encloses, and its triangles.
struct Piece {
  Box box;
  double volume_m3 = 0;
  bool is_closed = true;
  std::vector<int> triangles;

  void add(const Piece& other) {
    box.extend(other.box);
    triangles.insert(triangles.end(), other.triangles.begin(), other.triangles.end());
  }
};

/// Of triangles that share vertices: which part each is of, numbered by their first ones.
std::vector<std::size_t> parts_of(const TriangleMesh& mesh) {
  std::vector<int> above(mesh.vertices.size());
  std::iota(above.begin(), above.end(), 0);
  const auto root = [&above](int vertex) {
    while (above[static_cast<std::size_t>(vertex)] != vertex) {
      int& up = above[static_cast<std::size_t>(vertex)];
      vertex = up = above[static_cast<std::size_t>(up)];
    }
    return static_cast<std::size_t>(vertex);
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    above[root(b)] = static_cast<int>(root(a));
    above[root(c)] = static_cast<int>(root(a));
  }
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> number(mesh.vertices.size(), kNone), parts;
  std::size_t count = 0;
  parts.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    std::size_t& part = number[root(triangle[0])];
    if (part == kNone) part = count++;
    parts.push_back(part);
  }
  return parts;
}

/// In      edges  of each triangle, by number
std::vector<Piece> pieces_of(const TriangleMesh& mesh, const std::vector<std::array<std::uint32_t, 3>>& edges) {
  const std::vector<std::size_t> part_of = parts_of(mesh);
  std::vector<Piece> pieces(*std::ranges::max_element(part_of) + 1);
  std::vector<int> triangles_at(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    Piece& piece = pieces[part_of[i]];
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])];
      piece.box.extend(corners[k]);
    }
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
    if (!piece.is_closed) {
      rest.add(piece);
    } else if (piece.volume_m3 > 0) {
      solids.push_back(piece);
    }
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

/// Those of which the box meets another's, what is closed together alone, and what crosses itself.
/// In      crosses  of each triangle, whether it crosses another
std::vector<Piece> not_alone(std::vector<Piece> solids, const std::vector<bool>& crosses) {
  std::ranges::sort(solids, {}, [](const Piece& solid) { return solid.box.min().x(); });
  std::vector<bool> overlaps(solids.size(), false);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const auto is_crossing = [&](int triangle) { return crosses[static_cast<std::size_t>(triangle)]; };
    overlaps[i] = !solids[i].is_closed || std::ranges::any_of(solids[i].triangles, is_crossing);
  }
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

}  // namespace

/// Slabs across the longest axis say which parts a point may be in.
struct TriangleTree::Parts {
  struct Part {
    /// In      inner  of it, if it is not closed
    Part(const Piece& piece, TriangleMesh of_piece, const TriangleMesh& inner)
        : box(piece.box), mesh(std::move(of_piece)), tree(mesh), triangles(piece.triangles) {
      const std::vector<bool> crosses = tree.crossing();
      if (piece.is_closed && std::ranges::none_of(crosses, std::identity())) return;
      whole = mesh;
      if (!piece.is_closed) append(whole, inner);
      winding.emplace(whole);
      find_sound(crosses);
    }

    /// Where the faces at an edge do not pair up, or cross others, the nearest one does not say which side is inside.
    Closest closest(const Vec3& p_S) const {
      Closest found = tree.closest(p_S);
      if (winding && !is_sound[static_cast<std::size_t>(found.triangle)]) face(found, p_S, is_inside(p_S));
      return found;
    }
    bool is_inside(const Vec3& p_S) const { return std::abs(winding->at(p_S)) > 0.5; }
    void find_sound(const std::vector<bool>& crosses);
    bool has_inside_below(std::size_t triangle) const;
    /// Turns the normal so that it says so.
    static void face(Closest& found, const Vec3& p_S, bool is_inside) {
      if ((signed_m(found, p_S) < 0) == is_inside || !(found.distance_m > 0)) return;
      found.normal_S = (is_inside ? -1 : 1) * (p_S - found.point_S) / found.distance_m;
    }

    Box box;
    TriangleMesh mesh;
    TriangleTree tree;
    std::vector<int> triangles;  ///< of the mesh that it is a part of, in the order of its own
    // Of what is closed together alone, or crosses itself.
    TriangleMesh whole;
    std::optional<WindingNumber> winding;
    std::vector<bool> is_sound;  ///< of each of its triangles: its normal says what is inside
  };

  Parts(const TriangleMesh& mesh, const TriangleMesh& inner, const std::vector<Piece>& pieces)
      : is_sound(mesh.triangles.size(), true) {
    Cutter cutter(mesh);
    for (const Piece& piece : pieces) {
      all.extend(piece.box);
      parts.push_back(std::make_unique<Part>(piece, cutter.cut(piece), inner));
      for (std::size_t i = 0; i < parts.back()->is_sound.size(); ++i) {
        is_sound[static_cast<std::size_t>(piece.triangles[i])] = parts.back()->is_sound[i];
      }
    }
    all.sizes().maxCoeff(&axis);
    slabs.resize(std::min(kMaxSlabs, 2 * parts.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::size_t last = slab_of(parts[i]->box.max());
      for (std::size_t k = slab_of(parts[i]->box.min()); k <= last; ++k) slabs[k].push_back(i);
    }
  }

  std::size_t slab_of(const Vec3& p_S) const {
    const double share = (p_S[axis] - all.min()[axis]) / all.sizes()[axis];
    return std::min(static_cast<std::size_t>(share * static_cast<double>(slabs.size())), slabs.size() - 1);
  }

  Box all;
  Eigen::Index axis = 0;
  std::vector<std::unique_ptr<Part>> parts;
  std::vector<bool> is_sound;  ///< likewise, of each triangle of the mesh
  std::vector<std::vector<std::size_t>> slabs;
};

/// All edges at its corners pair up, no other one crosses it, and all of it is a border.
void TriangleTree::Parts::Part::find_sound(const std::vector<bool>& crosses) {
  const std::size_t count = mesh.triangles.size();
  std::vector<int> triangles_at(3 * count);
  for (const auto& edges : tree.edges_of_slot_) {
    for (const std::uint32_t edge : edges) ++triangles_at[edge];
  }
  std::vector<bool> is_end(mesh.vertices.size(), false);
  for (std::size_t slot = 0; slot < count; ++slot) {
    for (std::size_t side = 0; side < 3; ++side) {
      if (triangles_at[tree.edges_of_slot_[slot][side]] == 2) continue;
      is_end[tree.vertices_of_slot_[slot][side]] = is_end[tree.vertices_of_slot_[slot][(side + 1) % 3]] = true;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto ends = [&](int vertex) { return is_end[static_cast<std::size_t>(vertex)]; };
    is_sound.push_back(!crosses[i] && std::ranges::none_of(mesh.triangles[i], ends) && has_inside_below(i));
  }
}

/// At its middle, and near its corners and the middles of its sides.
bool TriangleTree::Parts::Part::has_inside_below(std::size_t triangle) const {
  constexpr double kBeside = 1e-5, kToTheRim = 0.8;
  std::array<Vec3, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][k])];
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
  const Vec3 step = kBeside * box.diagonal().norm() * normal;
  const Vec3 middle = (corners[0] + corners[1] + corners[2]) / 3;
  const auto is_border = [&](const Vec3& p_S) { return is_inside(p_S - step) && !is_inside(p_S + step); };
  if (!is_border(middle)) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 side = (corners[k] + corners[(k + 1) % 3]) / 2;
    if (!is_border(middle + kToTheRim * (corners[k] - middle)) || !is_border(middle + kToTheRim * (side - middle)))
      return false;
  }
  return true;
}

void TriangleTree::find_parts(const TriangleMesh& mesh, const TriangleMesh& inner) {
  std::vector<std::array<std::uint32_t, 3>> edges(mesh.triangles.size());
  for (std::size_t slot = 0; slot < edges.size(); ++slot) edges[triangle_of_slot_[slot]] = edges_of_slot_[slot];
  const std::vector<Piece> pieces = pieces_of(mesh, edges);
  const std::vector<Piece> found = not_alone(solids_of(pieces), crossing());
  if (!found.empty()) parts_ = std::make_shared<Parts>(mesh, inner, found);
}

TriangleTree TriangleTree::of_solid(const TriangleMesh& mesh, const TriangleMesh& inner) {
  TriangleTree tree(mesh);
  tree.find_parts(mesh, inner);
  return tree;
}

TriangleTree::Closest TriangleTree::closest_of_solid(const Vec3& p_S, double limit_m, int hint) const noexcept {
  Closest best = closest(p_S, limit_m, hint);
  if (parts_ == nullptr) return best;
  double deepest_m = 0;
  const bool may_be_inside = parts_->all.contains(p_S);
  for (const std::size_t i : parts_->slabs[may_be_inside ? parts_->slab_of(p_S) : 0]) {
    const Parts::Part& part = *parts_->parts[i];
    if (!part.box.contains(p_S)) continue;
    Closest closest = part.closest(p_S);
    const double signed_distance_m = signed_m(closest, p_S);
    if (signed_distance_m >= deepest_m) continue;
    deepest_m = signed_distance_m;
    closest.triangle = part.triangles[static_cast<std::size_t>(closest.triangle)];
    best = closest;
  }
  if (!(best.distance_m < limit_m)) return {};
  const bool is_sound = parts_->is_sound[static_cast<std::size_t>(best.triangle)];
  if (deepest_m == 0 && !is_sound) Parts::Part::face(best, p_S, false);
  return best;
}

double TriangleTree::signed_distance_m(const Vec3& p_S) const noexcept {
  return signed_m(closest_of_solid(p_S), p_S);
}

}  // namespace tandem::geometry

#include "common/geometry/repair/mesh_connectivity.hpp"

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "common/base/units.hpp"
#include "common/geometry/mesh_repair.hpp"

namespace tandem::geometry {
namespace {

constexpr int kNoTriangle = -1;
// If the angle between two triangles at an edge is below this value, they are treated as coincident. Rounding to single
// precision rotates a triangle by this angle if its height is 1/100 of the mesh's size.
constexpr double kSameAngle_rad = 2e-5;

/// Returns the number of a half-edge: 3 · triangle + side.
int number_of(const HalfEdge& half) {
  return 3 * half.triangle + half.side;
}

/// Orientation of a triangle relative to the first triangle of its part: equal or opposite.
enum class Turning : std::uint8_t { kUnknown, kAlong, kAgainst };

class Connector {
 public:
  explicit Connector(TriangleMesh& mesh)
      : mesh_(mesh),
        partner_(mesh.triangles.size() * 3, kNoTriangle),
        turning_(mesh.triangles.size(), Turning::kUnknown) {}

  /// Finds the opposite half-edge of every half-edge.
  void pair_edges() {
    const EdgeUses edges(mesh_);
    for (std::size_t edge = 0; edge < edges.edge_count(); ++edge) {
      const auto uses = edges.uses(edge);
      if (uses.size() == 2) {
        join(uses[0], uses[1]);
      } else if (uses.size() > 2 && !pair_around(uses)) {
        for (const HalfEdge& half : uses) unpaired_.push_back(half.triangle);
      }
    }
  }

  /// Separates fans, which are groups of triangles connected around a vertex. If several fans meet at the same vertex,
  /// each gets its own copy of it. Returns the number of vertices added.
  std::size_t separate_fans() {
    std::vector<int> root(partner_.size());
    std::iota(root.begin(), root.end(), 0);
    for (std::size_t half = 0; half < partner_.size(); ++half) {
      const int other = partner_[half];
      if (other <= static_cast<int>(half)) continue;
      const int a = static_cast<int>(half);
      const int b = next_side(a);
      const int c = other;
      const int d = next_side(c);
      const bool is_opposed = vertex_at(a) == vertex_at(d);
      unite(root, a, is_opposed ? d : c);
      unite(root, b, is_opposed ? c : d);
    }
    const std::size_t before = mesh_.vertices.size();
    std::vector<int> fan_of_vertex(before, kNoTriangle);
    std::vector<int> vertex_of_fan(partner_.size(), kNoTriangle);
    for (int corner = 0; corner < static_cast<int>(partner_.size()); ++corner) {
      const auto fan = static_cast<std::size_t>(find(root, corner));
      int& vertex = mesh_.triangles[static_cast<std::size_t>(corner / 3)][static_cast<std::size_t>(corner % 3)];
      if (vertex_of_fan[fan] == kNoTriangle) {
        const bool is_taken = fan_of_vertex[static_cast<std::size_t>(vertex)] != kNoTriangle;
        vertex_of_fan[fan] = is_taken ? static_cast<int>(mesh_.vertices.size()) : vertex;
        if (is_taken) {
          mesh_.vertices.push_back(Vec3(mesh_.vertices[static_cast<std::size_t>(vertex)]));
        } else {
          fan_of_vertex[static_cast<std::size_t>(vertex)] = static_cast<int>(fan);
        }
      }
      vertex = vertex_of_fan[fan];
    }
    return mesh_.vertices.size() - before;
  }

  /// Finds the parts and makes the orientation of their triangles consistent. Returns the number of triangles reversed.
  std::size_t orient(std::vector<MeshPart>& parts) {
    std::size_t total = 0;
    for (std::size_t seed = 0; seed < turning_.size(); ++seed) {
      if (turning_[seed] != Turning::kUnknown) continue;
      parts.push_back(flood(static_cast<int>(seed)));
      const auto& triangles = parts.back().triangles;
      const auto is_turned = [this](int t) { return turning_[static_cast<std::size_t>(t)] == Turning::kAgainst; };
      const auto count = std::count_if(triangles.begin(), triangles.end(), is_turned);
      // The smaller set of triangles is reversed: those marked kAgainst, or all others.
      const bool is_minority = 2 * static_cast<std::size_t>(count) <= triangles.size();
      for (const int t : triangles) {
        if (is_turned(t) != is_minority) continue;
        turn(t);
        ++total;
      }
    }
    return total;
  }

  void mark_unpaired(std::vector<MeshPart>& parts) const {
    std::vector<bool> is_unpaired(mesh_.triangles.size(), false);
    for (const int t : unpaired_) is_unpaired[static_cast<std::size_t>(t)] = true;
    for (MeshPart& part : parts) {
      part.is_unpaired =
          std::ranges::any_of(part.triangles, [&](int t) { return is_unpaired[static_cast<std::size_t>(t)]; });
    }
  }

  void find_borders(MeshPart& part, std::vector<int>& border_from) const {
    if (!part.is_orientable) return;
    std::vector<int> halves;
    for (const int t : part.triangles) {
      for (int half = 3 * t; half < 3 * t + 3; ++half) {
        if (partner_[static_cast<std::size_t>(half)] != kNoTriangle) continue;
        halves.push_back(half);
        border_from[static_cast<std::size_t>(vertex_at(half))] = half;
      }
    }
    for (const int first : halves) {
      std::vector<int> loop;
      // At a border, each vertex has one fan of triangles, so only one border edge starts at each vertex. Following the
      // border therefore ends at the first edge.
      for (int half = first; half != kNoTriangle;) {
        int& leaving = border_from[static_cast<std::size_t>(vertex_at(half))];
        if (leaving == kNoTriangle) break;
        leaving = kNoTriangle;
        loop.push_back(vertex_at(half));
        half = border_from[static_cast<std::size_t>(vertex_at(next_side(half)))];
      }
      if (!loop.empty()) part.borders.push_back(std::move(loop));
    }
  }

 private:
  static int next_side(int half) { return half % 3 == 2 ? half - 2 : half + 1; }
  int vertex_at(int half) const {
    return mesh_.triangles[static_cast<std::size_t>(half / 3)][static_cast<std::size_t>(half % 3)];
  }

  void join(const HalfEdge& a, const HalfEdge& b) {
    partner_[static_cast<std::size_t>(number_of(a))] = number_of(b);
    partner_[static_cast<std::size_t>(number_of(b))] = number_of(a);
  }

  /// A triangle as seen along one of its edges. The edge appears as a point, and the triangle as a line from this
  /// point.
  struct Spoke {
    double angle_rad;
    bool runs_along;
    HalfEdge half;
  };

  /// Orders coincident spokes so that their triangles traverse the edge alternately forwards and backwards. Without
  /// this, their order would depend on rounding.
  /// In      spokes  sorted by angle
  /// Out     true if the directions alternate all around the edge
  static bool alternate(std::vector<Spoke>& spokes) {
    // The loop must not start within a group of coincident spokes, so it starts after a gap. If all spokes coincide,
    // any start is suitable.
    std::size_t start = 0;
    while (start < spokes.size() && !is_gap(spokes, start)) ++start;
    std::rotate(spokes.begin(), spokes.begin() + static_cast<std::ptrdiff_t>(start % spokes.size()), spokes.end());
    for (const bool first : {spokes.front().runs_along, !spokes.front().runs_along}) {
      std::vector<Spoke> ordered = spokes;
      bool wanted = first;
      bool is_good = true;
      for (std::size_t i = 0; i < ordered.size() && is_good; ++i, wanted = !wanted) {
        std::size_t j = i;
        while (ordered[j].runs_along != wanted && j + 1 < ordered.size() && !is_gap(spokes, j + 1)) ++j;
        is_good = ordered[j].runs_along == wanted;
        std::rotate(ordered.begin() + static_cast<std::ptrdiff_t>(i), ordered.begin() + static_cast<std::ptrdiff_t>(j),
                    ordered.begin() + static_cast<std::ptrdiff_t>(j) + 1);
      }
      if (!is_good || wanted != first) continue;
      spokes = std::move(ordered);
      return true;
    }
    return false;
  }

  /// Returns whether there is a gap between spoke `i` and the previous one.
  static bool is_gap(const std::vector<Spoke>& spokes, std::size_t i) {
    const double before = spokes[(i + spokes.size() - 1) % spokes.size()].angle_rad;
    const double apart = std::abs(spokes[i].angle_rad - before);
    return std::min(apart, 2 * std::numbers::pi - apart) > kSameAngle_rad;
  }

  /// Pairs the triangles around an edge that enclose material between them. Seen along the edge, the material of a
  /// triangle that traverses the edge backwards is on its anticlockwise side; that of a forward one, on its clockwise
  /// side. Each backward triangle is therefore paired with the next one in anticlockwise direction. Returns false if
  /// that triangle is not a forward one.
  bool pair_around(std::span<const HalfEdge> uses) {
    const int a = start_of(mesh_, uses[0]);
    const Vec3& origin = mesh_.vertices[static_cast<std::size_t>(a)];
    const Vec3 axis = (mesh_.vertices[static_cast<std::size_t>(end_of(mesh_, uses[0]))] - origin).normalized();
    const Vec3 u = axis.unitOrthogonal();
    const Vec3 v = axis.cross(u);
    std::vector<Spoke> spokes;
    for (const HalfEdge& half : uses) {
      const Vec3 to_apex = mesh_.vertices[static_cast<std::size_t>(apex_of(mesh_, half))] - origin;
      spokes.push_back({std::atan2(to_apex.dot(v), to_apex.dot(u)), start_of(mesh_, half) == a, half});
    }
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& x, const Spoke& y) { return x.angle_rad < y.angle_rad; });
    if (!alternate(spokes)) return false;
    for (std::size_t i = spokes[0].runs_along ? 1 : 0; i < spokes.size(); i += 2) {
      join(spokes[i].half, spokes[(i + 1) % spokes.size()].half);
    }
    return true;
  }

  static int find(std::vector<int>& root, int corner) {
    while (root[static_cast<std::size_t>(corner)] != corner) {
      int& above = root[static_cast<std::size_t>(corner)];
      above = root[static_cast<std::size_t>(above)];
      corner = above;
    }
    return corner;
  }
  static void unite(std::vector<int>& root, int a, int b) {
    const int first = find(root, a);
    const int second = find(root, b);
    root[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
  }

  MeshPart flood(int seed) {
    MeshPart part;
    part.triangles.push_back(seed);
    turning_[static_cast<std::size_t>(seed)] = Turning::kAlong;
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
      const int triangle = part.triangles[i];
      for (int half = 3 * triangle; half < 3 * triangle + 3; ++half) {
        const int other = partner_[static_cast<std::size_t>(half)];
        if (other == kNoTriangle) continue;
        // Neighbours have consistent orientations if they traverse their common edge in opposite directions.
        const bool agrees = vertex_at(half) == vertex_at(next_side(other));
        const bool is_along = (turning_[static_cast<std::size_t>(triangle)] == Turning::kAlong) == agrees;
        const Turning wanted = is_along ? Turning::kAlong : Turning::kAgainst;
        Turning& state = turning_[static_cast<std::size_t>(other / 3)];
        if (state == Turning::kUnknown) {
          state = wanted;
          part.triangles.push_back(other / 3);
        } else if (state != wanted) {
          part.is_orientable = false;
        }
      }
    }
    return part;
  }

  void turn(int triangle) {
    auto& corners = mesh_.triangles[static_cast<std::size_t>(triangle)];
    std::swap(corners[1], corners[2]);
    // Reversing a triangle exchanges its sides 0 and 2, so their entries are exchanged as well.
    std::swap(partner_[static_cast<std::size_t>(3 * triangle)], partner_[static_cast<std::size_t>(3 * triangle + 2)]);
    for (int half = 3 * triangle; half < 3 * triangle + 3; ++half) {
      const int other = partner_[static_cast<std::size_t>(half)];
      if (other == kNoTriangle) continue;
      partner_[static_cast<std::size_t>(other)] = half;
    }
  }

  TriangleMesh& mesh_;
  std::vector<int> partner_;  // for each half-edge: its opposite half-edge; kNoTriangle at a border
  std::vector<Turning> turning_;
  std::vector<int> unpaired_;  // triangles at edges whose triangles cannot be paired
};

}  // namespace

std::vector<MeshPart> connect(TriangleMesh& mesh, std::vector<std::string>& notes) {
  Connector connector(mesh);
  connector.pair_edges();
  const std::size_t separated = connector.separate_fans();
  if (separated > 0) {
    notes.push_back(counted(separated, "vertex", "vertices") + " doubled where parts only touch");
  }
  std::vector<MeshPart> parts;
  const std::size_t turned = connector.orient(parts);
  if (turned > 0) {
    notes.push_back(counted(turned, "triangle turned to run as its neighbours do",
                            "triangles turned to run as their neighbours do"));
  }
  std::vector<int> border_from(mesh.vertices.size(), kNoTriangle);
  for (MeshPart& part : parts) connector.find_borders(part, border_from);
  connector.mark_unpaired(parts);
  return parts;
}

std::vector<int> triangles_of(const std::vector<MeshPart>& parts) {
  std::vector<int> triangles;
  for (const MeshPart& part : parts) triangles.insert(triangles.end(), part.triangles.begin(), part.triangles.end());
  return triangles;
}

}  // namespace tandem::geometry

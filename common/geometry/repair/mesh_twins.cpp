#include "common/geometry/repair/mesh_twins.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/geometry/closest_on_triangle.hpp"
#include "common/geometry/mesh_edges.hpp"

namespace tandem::geometry {
namespace {

// Maximum number of rounds. Each round removes one layer of duplicates. After that, patches beside a removed one may
// join to form larger patches, which may be duplicates, too.
constexpr int kMaxRounds = 8;
// A patch ends at an edge where the surface folds back, with an angle below 45° between its two sides.
constexpr double kMaxFoldCosine = 0.707;
// Patches with at most this number of border edges are duplicates if their borders are equal and they are close to each
// other. Larger patches are duplicates only if they cover each other.
constexpr std::size_t kMaxCorners = 64;
// Largest distance between two triangulations of a twisted polygon that are treated as duplicates, as a fraction of the
// square root of its area. They could also be the two sides of a thin solid. If all edges of the polygon have further
// triangles, duplicates are likely, and the full distance is allowed. Otherwise, it is reduced in proportion.
constexpr double kTwistShare = 0.25;
// Largest relative difference of the areas of coincident pieces: the rounding error of single precision.
constexpr double kAreaShare = 1e-5;
// Maximum number of candidates that are compared with a patch. Usually there are few.
constexpr std::size_t kMaxCandidates = 16;
constexpr std::size_t kMaxOverlaps = 20'000'000;
// A direction without symmetry. In man-made shapes, two corners hardly ever have the same coordinate along it. The
// first and the last corner of a patch along this direction are thus unique, and duplicates have the same ones.
const Vec3 kAlong(0.5381947, 0.3017251, 0.7869843);

struct Patch {
  std::vector<int> triangles;
  std::vector<std::uint32_t> border;  ///< sorted edges; empty if there are too many
  std::size_t shared = 0;             ///< number of border edges that are used by more than two triangles
  double area_m2 = 0;
  int first_along = -1;  ///< vertices of the patch with the smallest and the largest coordinate along kAlong
  int last_along = -1;
};

class Patches {
 public:
  explicit Patches(const TriangleMesh& mesh) : mesh_(mesh), edges_(mesh), partner_(3 * mesh.triangles.size(), -1) {
    edge_of_.resize(partner_.size());
    for (std::size_t edge = 0; edge < edges_.edge_count(); ++edge) {
      const auto uses = edges_.uses(edge);
      for (const HalfEdge& half : uses) edge_of_[number_of(half)] = static_cast<std::uint32_t>(edge);
      if (uses.size() != 2 || folds_back(uses[0], uses[1])) continue;
      partner_[number_of(uses[0])] = uses[1].triangle;
      partner_[number_of(uses[1])] = uses[0].triangle;
    }
    std::vector<bool> is_taken(mesh.triangles.size(), false);
    for (std::size_t seed = 0; seed < is_taken.size(); ++seed) {
      if (!is_taken[seed]) patches_.push_back(flood(static_cast<int>(seed), is_taken));
    }
  }
  const std::vector<Patch>& all() const { return patches_; }

 private:
  static std::size_t number_of(const HalfEdge& half) { return static_cast<std::size_t>(3 * half.triangle + half.side); }

  bool folds_back(const HalfEdge& a, const HalfEdge& b) const {
    const Vec3& from = mesh_.vertices[static_cast<std::size_t>(start_of(mesh_, a))];
    const Vec3 edge = mesh_.vertices[static_cast<std::size_t>(end_of(mesh_, a))] - from;
    const auto away = [&](const HalfEdge& half) {
      const Vec3 to_apex = mesh_.vertices[static_cast<std::size_t>(apex_of(mesh_, half))] - from;
      return Vec3(to_apex * edge.squaredNorm() - edge * edge.dot(to_apex));
    };
    const Vec3 u = away(a);
    const Vec3 v = away(b);
    const double dot = u.dot(v);
    return dot > 0 && dot * dot > kMaxFoldCosine * kMaxFoldCosine * u.squaredNorm() * v.squaredNorm();
  }

  Patch flood(int seed, std::vector<bool>& is_taken) const {
    Patch patch;
    patch.triangles.push_back(seed);
    is_taken[static_cast<std::size_t>(seed)] = true;
    bool is_long = false;
    double first = std::numeric_limits<double>::infinity();
    double last = -first;
    for (std::size_t i = 0; i < patch.triangles.size(); ++i) {
      const auto t = static_cast<std::size_t>(patch.triangles[i]);
      patch.area_m2 += doubled_area(mesh_, t).norm() / 2;
      for (std::size_t half = 3 * t; half < 3 * t + 3; ++half) {
        const int vertex = mesh_.triangles[t][half - 3 * t];
        const double along = kAlong.dot(mesh_.vertices[static_cast<std::size_t>(vertex)]);
        if (along < first) first = along, patch.first_along = vertex;
        if (along > last) last = along, patch.last_along = vertex;
        if (const int other = partner_[half]; other >= 0) {
          if (is_taken[static_cast<std::size_t>(other)]) continue;
          is_taken[static_cast<std::size_t>(other)] = true;
          patch.triangles.push_back(other);
        } else if (!is_long) {
          patch.border.push_back(edge_of_[half]);
          if (edges_.uses(edge_of_[half]).size() > 2) ++patch.shared;
          is_long = patch.border.size() > kMaxCorners;
        }
      }
    }
    if (is_long) patch.border.clear();
    std::sort(patch.border.begin(), patch.border.end());
    return patch;
  }

  const TriangleMesh& mesh_;
  EdgeUses edges_;
  std::vector<int> partner_;  // for each half-edge: triangle on its other side if the surface continues there; else −1
  std::vector<std::uint32_t> edge_of_;
  std::vector<Patch> patches_;
};

/// Returns the area of the intersection of two coplanar triangles.
double common_area_m2(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, const Vec3& normal) {
  std::vector<Vec3> kept(a.begin(), a.end());
  std::vector<Vec3> clipped;
  const double turn = (b[1] - b[0]).cross(b[2] - b[0]).dot(normal) < 0 ? -1 : 1;
  for (std::size_t side = 0; side < 3 && !kept.empty(); ++side) {
    const Vec3 inward = turn * normal.cross(b[(side + 1) % 3] - b[side]);
    clipped.clear();
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const Vec3& p = kept[i];
      const Vec3& q = kept[(i + 1) % kept.size()];
      const double dp = inward.dot(p - b[side]);
      const double dq = inward.dot(q - b[side]);
      if (dp >= 0) clipped.push_back(p);
      if ((dp < 0) != (dq < 0)) clipped.emplace_back(p + dp / (dp - dq) * (q - p));
    }
    kept.swap(clipped);
  }
  Vec3 doubled = Vec3::Zero();
  for (std::size_t i = 2; i < kept.size(); ++i) doubled += (kept[i - 1] - kept[0]).cross(kept[i] - kept[0]);
  return doubled.norm() / 2;
}

class Comparer {
 public:
  Comparer(const TriangleMesh& mesh, double tolerance_m) : mesh_(mesh), tolerance_m_(tolerance_m) {}

  /// Returns whether two patches with the same border are close to each other.
  bool lie_close(const Patch& a, const Patch& b) const {
    const double size_m = std::sqrt(std::min(a.area_m2, b.area_m2));
    const bool is_polygon = a.triangles.size() + 2 == a.border.size() && b.triangles.size() == a.triangles.size();
    const double shared = static_cast<double>(a.shared) / static_cast<double>(a.border.size());
    const double most_m = std::max(2 * tolerance_m_, is_polygon ? kTwistShare * shared * size_m : 0);
    return is_near(a, b, most_m) && is_near(b, a, most_m);
  }

  /// Returns whether two patches with the same end vertices cover each other.
  bool cover_each_other(const Patch& a, const Patch& b) const {
    const double least_m2 = (1 - kAreaShare) * std::max(a.area_m2, b.area_m2);
    if (std::min(a.area_m2, b.area_m2) < least_m2) return false;
    const std::vector<Extent> theirs = extents_of(b);
    double longest = 0;
    for (const Extent& extent : theirs) longest = std::max(longest, extent.to - extent.from);
    double covered_m2 = 0;
    double seen_m2 = 0;
    std::size_t comparisons = 0;
    for (const Extent& mine : extents_of(a)) {
      const auto starts = [](const Extent& extent, double from) { return extent.from < from; };
      auto other = std::lower_bound(theirs.begin(), theirs.end(), mine.from - longest - tolerance_m_, starts);
      for (; other != theirs.end() && other->from <= mine.to + tolerance_m_; ++other) {
        if (++comparisons > kMaxOverlaps) return false;
        if (other->to >= mine.from - tolerance_m_) covered_m2 += common_area_m2_of(mine.triangle, other->triangle);
      }
      seen_m2 += doubled_area(mesh_, mine.triangle).norm() / 2;
      if (covered_m2 < seen_m2 - 2 * kAreaShare * a.area_m2) return false;
    }
    return covered_m2 >= least_m2;
  }

 private:
  struct Extent {
    double from;
    double to;
    std::size_t triangle;
  };

  std::array<Vec3, 3> corners(std::size_t triangle) const {
    const auto& at = mesh_.triangles[triangle];
    return {mesh_.vertices[static_cast<std::size_t>(at[0])], mesh_.vertices[static_cast<std::size_t>(at[1])],
            mesh_.vertices[static_cast<std::size_t>(at[2])]};
  }

  std::vector<Extent> extents_of(const Patch& patch) const {
    std::vector<Extent> extents;
    extents.reserve(patch.triangles.size());
    for (const int t : patch.triangles) {
      const auto triangle = static_cast<std::size_t>(t);
      const auto [a, b, c] = corners(triangle);
      const auto [from, to] = std::minmax({kAlong.dot(a), kAlong.dot(b), kAlong.dot(c)});
      extents.push_back({from, to, triangle});
    }
    std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) { return a.from < b.from; });
    return extents;
  }

  double common_area_m2_of(std::size_t a, std::size_t b) const {
    Vec3 of_a = doubled_area(mesh_, a);
    const Vec3 of_b = doubled_area(mesh_, b);
    if (of_a.squaredNorm() < of_b.squaredNorm()) {
      std::swap(a, b);
      of_a = of_b;
    }
    const Vec3 normal = of_a.normalized();
    const std::array<Vec3, 3> larger = corners(a);
    std::array<Vec3, 3> smaller = corners(b);
    for (Vec3& p : smaller) {
      const double off = normal.dot(p - larger[0]);
      if (std::abs(off) > 2 * tolerance_m_) return 0;
      p -= off * normal;
    }
    return common_area_m2(smaller, larger, normal);
  }

  /// Returns whether `b` is close to `a` at the middles of a's triangles and of their sides. The corners need no test,
  /// because both patches have the same corners.
  bool is_near(const Patch& a, const Patch& b, double most_m) const {
    const auto lies_at = [&](const Vec3& p) {
      return std::ranges::any_of(b.triangles, [&](int t) {
        const auto [q, r, s] = corners(static_cast<std::size_t>(t));
        return (closest_on_triangle(r - q, s - q, p - q).from_a - (p - q)).squaredNorm() <= most_m * most_m;
      });
    };
    return std::ranges::all_of(a.triangles, [&](int t) {
      const auto [q, r, s] = corners(static_cast<std::size_t>(t));
      return lies_at((q + r + s) / 3) && lies_at((q + r) / 2) && lies_at((r + s) / 2) && lies_at((s + q) / 2);
    });
  }

  const TriangleMesh& mesh_;
  double tolerance_m_;
};

/// Marks each patch that duplicates an earlier one. `order` is sorted so that patches for which `is_alike` is true are
/// consecutive; only these are compared.
template <typename Alike, typename Twins>
void mark_twins(std::span<const std::size_t> order, Alike is_alike, Twins are_twins, std::vector<bool>& is_twin) {
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (is_twin[order[i]]) continue;
    for (std::size_t j = i + 1; j < order.size() && j <= i + kMaxCandidates && is_alike(order[i], order[j]); ++j) {
      if (!is_twin[order[j]] && are_twins(order[i], order[j])) is_twin[order[j]] = true;
    }
  }
}

std::size_t drop_once(TriangleMesh& mesh, double tolerance_m) {
  const Patches found(mesh);
  const std::vector<Patch>& patches = found.all();
  if (patches.size() < 2) return 0;
  const Comparer comparer(mesh, tolerance_m);
  std::vector<bool> is_twin(patches.size(), false);

  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!patches[i].border.empty() && patches[i].triangles.size() <= kMaxCorners) order.push_back(i);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return patches[a].border < patches[b].border; });
  mark_twins(
      order, [&](std::size_t a, std::size_t b) { return patches[a].border == patches[b].border; },
      [&](std::size_t a, std::size_t b) { return comparer.lie_close(patches[a], patches[b]); }, is_twin);

  order.clear();
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!is_twin[i]) order.push_back(i);
  }
  const auto ends = [&](std::size_t i) { return std::pair(patches[i].first_along, patches[i].last_along); };
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return ends(a) < ends(b); });
  mark_twins(
      order, [&](std::size_t a, std::size_t b) { return ends(a) == ends(b); },
      [&](std::size_t a, std::size_t b) { return comparer.cover_each_other(patches[a], patches[b]); }, is_twin);

  const std::size_t before = mesh.triangles.size();
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!is_twin[i]) continue;
    for (const int t : patches[i].triangles) mesh.triangles[static_cast<std::size_t>(t)] = {0, 0, 0};
  }
  std::erase_if(mesh.triangles, [](const auto& triangle) { return triangle[0] == triangle[1]; });
  return before - mesh.triangles.size();
}

}  // namespace

std::size_t drop_twin_patches(TriangleMesh& mesh, double tolerance_m) {
  std::size_t dropped = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::size_t here = drop_once(mesh, tolerance_m);
    if (here == 0) break;
    dropped += here;
  }
  return dropped;
}

}  // namespace tandem::geometry

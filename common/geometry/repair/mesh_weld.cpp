#include "common/geometry/repair/mesh_weld.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "common/base/units.hpp"
#include "common/geometry/mesh_edges.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/repair/mesh_twins.hpp"

namespace tandem::geometry {
namespace {

// Lengths as fractions of the bounding box's diagonal: distance up to which vertices are merged, and height below which
// a triangle counts as flat.
constexpr double kWeldShare = 1e-7;
constexpr double kFlatShare = 1e-9;
// Maximum number of rounds that remove flat triangles. When a flat triangle is removed, its neighbour is divided, which
// may create another flat triangle, and so on. If such a chain is longer than this, a gap remains.
constexpr int kFlatRounds = 8;
// Limit of the hash table probes per vertex. Vertices more than 64 tolerances apart need two or three probes.
constexpr std::size_t kMaxProbesEach = 200;
constexpr std::size_t kMinMaxProbes = 10'000'000;
constexpr double kFarthestCube = 0x1p62;

/// Spatial hash of the positions found so far. The cubes are much wider than the tolerance, so most queries visit only
/// one cube.
class Places {
 public:
  Places(double tolerance_m, std::size_t most)
      : tolerance_m_(tolerance_m),
        slots_(std::bit_ceil(2 * most + 2), -1),
        max_probes_(kMinMaxProbes + kMaxProbesEach * most) {}

  /// Returns the index of the first position within the tolerance of `p`. If there is none, adds `p` and returns the
  /// index of `p`.
  int index_of(const Vec3& p) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 side((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
      const std::uint64_t key = key_of(p + tolerance_m_ * side);
      if (corner > 0 && key == last_key_) continue;
      last_key_ = key;
      const int found = find(key, p);
      if (found >= 0) return found;
    }
    const auto index = static_cast<int>(places_.size());
    places_.push_back(p);
    std::size_t at = start_of_search(key_of(p));
    while (slots_[at] >= 0) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = index;
    return index;
  }
  std::vector<Vec3> release() { return std::move(places_); }

 private:
  std::uint64_t key_of(const Vec3& p) const {
    std::uint64_t key = 0;
    for (const double value : p) {
      // Coordinates are clamped, because far from the origin the cubes would be narrower than the spacing of doubles.
      // All positions beyond the limit are in the outermost cube.
      const double cubes = std::clamp(value / (64 * tolerance_m_), -kFarthestCube, kFarthestCube);
      const auto cube = static_cast<std::int64_t>(std::floor(cubes));
      key = key * 0x9E3779B97F4A7C15U + static_cast<std::uint64_t>(cube);
    }
    return key;
  }
  std::size_t start_of_search(std::uint64_t key) const {
    const std::uint64_t product = (key ^ key >> 29U) * 0xBF58476D1CE4E5B9U;
    return static_cast<std::size_t>(product ^ product >> 32U) & (slots_.size() - 1);
  }
  [[noreturn]] static void refuse_crowd() {
    throw MeshError("most of its vertices are within 0.00001 of its size: is something stray far away from the rest?");
  }
  int find(std::uint64_t key, const Vec3& p) {
    for (std::size_t at = start_of_search(key); slots_[at] >= 0; at = (at + 1) & (slots_.size() - 1)) {
      if (++probes_ > max_probes_) refuse_crowd();
      const Vec3& place = places_[static_cast<std::size_t>(slots_[at])];
      if ((place - p).squaredNorm() <= tolerance_m_ * tolerance_m_) return slots_[at];
    }
    return -1;
  }

  double tolerance_m_;
  std::vector<int> slots_;
  std::vector<Vec3> places_;
  std::uint64_t last_key_ = 0;
  std::size_t max_probes_;
  std::size_t probes_ = 0;
};

bool has_three_corners(const std::array<int, 3>& triangle) {
  return triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0];
}

std::size_t drop_collapsed(TriangleMesh& mesh) {
  return std::erase_if(mesh.triangles, [](const auto& triangle) { return !has_three_corners(triangle); });
}

/// Removes triangles with the same three corners as an earlier triangle, in any orientation.
std::size_t drop_twins(TriangleMesh& mesh) {
  struct Entry {
    std::array<int, 3> corners;
    std::size_t index;
    bool operator<(const Entry& other) const {
      return corners != other.corners ? corners < other.corners : index < other.index;
    }
  };
  std::vector<Entry> sorted;
  sorted.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    sorted.push_back({mesh.triangles[i], i});
    std::sort(sorted.back().corners.begin(), sorted.back().corners.end());
  }
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].corners == sorted[i - 1].corners) mesh.triangles[sorted[i].index] = {0, 0, 0};
  }
  return drop_collapsed(mesh);
}

/// Longest side of a triangle, and whether the triangle is flat (its height is below the tolerance).
struct Flatness {
  int longest = 0;
  bool is_flat = false;
};

Flatness flatness_of(const TriangleMesh& mesh, std::size_t triangle, double tolerance_m) {
  Flatness flatness;
  double longest = 0;
  for (int side = 0; side < 3; ++side) {
    const HalfEdge half{static_cast<int>(triangle), side};
    const double length = (mesh.vertices[static_cast<std::size_t>(end_of(mesh, half))] -
                           mesh.vertices[static_cast<std::size_t>(start_of(mesh, half))])
                              .norm();
    if (length <= longest) continue;
    longest = length;
    flatness.longest = side;
  }
  flatness.is_flat = doubled_area(mesh, triangle).norm() <= tolerance_m * longest;
  return flatness;
}

/// Performs one round of the removal of flat triangles. Returns the number of flat triangles found.
std::size_t drop_flat_once(TriangleMesh& mesh, double tolerance_m) {
  std::vector<Flatness> flatness;
  flatness.reserve(mesh.triangles.size());
  std::size_t flat = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    flatness.push_back(flatness_of(mesh, i, tolerance_m));
    if (flatness.back().is_flat) ++flat;
  }
  if (flat == 0) return 0;

  const EdgeUses edges(mesh);
  const std::vector<std::array<int, 3>> before = mesh.triangles;
  std::vector<bool> is_changed(before.size(), false);
  for (std::size_t edge = 0; edge < edges.edge_count(); ++edge) {
    const auto uses = edges.uses(edge);
    for (std::size_t i = 0; i < uses.size(); ++i) {
      const auto triangle = static_cast<std::size_t>(uses[i].triangle);
      const bool is_here = flatness[triangle].is_flat && flatness[triangle].longest == uses[i].side;
      if (!is_here || is_changed[triangle]) continue;
      if (uses.size() == 2) {
        const HalfEdge& other = uses[1 - i];
        const auto beyond = static_cast<std::size_t>(other.triangle);
        if (is_changed[beyond]) continue;  // the neighbour was changed in this round, so the next round divides it
        const auto& corners = before[beyond];
        const int from = corners[static_cast<std::size_t>(other.side)];
        const int to = corners[static_cast<std::size_t>((other.side + 1) % 3)];
        const int apex = corners[static_cast<std::size_t>((other.side + 2) % 3)];
        const int middle = before[triangle][static_cast<std::size_t>((uses[i].side + 2) % 3)];
        is_changed[beyond] = true;
        mesh.triangles[beyond] = {from, middle, apex};
        mesh.triangles[triangle] = {middle, to, apex};
      } else {
        mesh.triangles[triangle] = {0, 0, 0};
      }
      is_changed[triangle] = true;
    }
  }
  drop_collapsed(mesh);
  return flat;
}

std::size_t drop_flat(TriangleMesh& mesh, double tolerance_m) {
  std::size_t first = 0;
  for (int round = 0; round < kFlatRounds; ++round) {
    const std::size_t flat = drop_flat_once(mesh, tolerance_m);
    if (round == 0) first = flat;
    if (flat == 0) return first;
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (flatness_of(mesh, i, tolerance_m).is_flat) mesh.triangles[i] = {0, 0, 0};
  }
  drop_collapsed(mesh);
  return first;
}

/// Removes vertices that no triangle uses. The order of the remaining vertices is preserved.
void drop_unused_vertices(TriangleMesh& mesh) {
  std::vector<int> index_of(mesh.vertices.size(), -1);
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) index_of[static_cast<std::size_t>(corner)] = 0;
  }
  int used = 0;
  for (std::size_t v = 0; v < index_of.size(); ++v) {
    if (index_of[v] < 0) continue;
    mesh.vertices[static_cast<std::size_t>(used)] = mesh.vertices[v];
    index_of[v] = used++;
  }
  mesh.vertices.resize(static_cast<std::size_t>(used));
  for (auto& triangle : mesh.triangles) {
    for (int& corner : triangle) corner = index_of[static_cast<std::size_t>(corner)];
  }
}

void note(std::vector<std::string>& notes, std::size_t count, const char* one, const char* many) {
  if (count > 0) notes.push_back(counted(count, one, many));
}

}  // namespace

double weld_tolerance_m(const TriangleMesh& mesh) {
  Vec3 low = mesh.vertices.front();
  Vec3 high = low;
  for (const Vec3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // If all vertices are at one point, the box has no size, and 1e-6 m is used instead.
  return kWeldShare * std::max((high - low).norm(), 1e-6);
}

void weld(TriangleMesh& mesh, std::vector<std::string>& notes) {
  if (mesh.vertices.empty()) return;
  const double tolerance_m = weld_tolerance_m(mesh);
  Places places(tolerance_m, mesh.vertices.size());
  std::vector<int> place_of;
  place_of.reserve(mesh.vertices.size());
  for (const Vec3& p : mesh.vertices) place_of.push_back(places.index_of(p));
  const std::size_t before = mesh.vertices.size();
  mesh.vertices = places.release();
  for (auto& triangle : mesh.triangles) {
    for (int& corner : triangle) corner = place_of[static_cast<std::size_t>(corner)];
  }
  note(notes, before - mesh.vertices.size(), "vertex merged with another at the same place",
       "vertices merged with others at the same place");
  note(notes, drop_collapsed(mesh) + drop_flat(mesh, tolerance_m * kFlatShare / kWeldShare),
       "triangle without area taken out", "triangles without area taken out");
  std::size_t twins = drop_twins(mesh);
  twins += drop_twin_patches(mesh, tolerance_m);
  note(notes, twins, "triangle taken out that was there twice", "triangles taken out that were there twice");
  drop_unused_vertices(mesh);
}

}  // namespace tandem::geometry

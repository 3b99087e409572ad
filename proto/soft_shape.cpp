#include "proto/soft_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>

namespace tandem::proto {
namespace {

constexpr int kEdge = static_cast<int>(kSoftLatticeEdge);
constexpr double kFinest_m = 5e-5, kMinQuantum_m = 1e-6, kMaxQuantum_m = 0.1;
constexpr double kMaxQuanta = 32767;
constexpr std::size_t kOffsetBytes = 6;

using Cell = std::array<int, 3>;

bool is_on_surface(const Cell& at) {
  return std::ranges::any_of(at, [](int index) { return index == 0 || index == kEdge - 1; });
}

std::vector<Cell> lattice_cells() {
  std::vector<Cell> cells;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        if (is_on_surface({x, y, z})) cells.push_back({x, y, z});
      }
    }
  }
  return cells;
}

/// Appends the triangles of one face of the box. The face is the one at the low or high end (`is_high`) of `axis`.
void append_side(int axis, bool is_high, const std::map<Cell, int>& index_of, std::vector<std::array<int, 3>>& faces) {
  const auto at = [&](int u, int v) {
    Cell cell{};
    cell[static_cast<std::size_t>(axis)] = is_high ? kEdge - 1 : 0;
    cell[static_cast<std::size_t>((axis + 1) % 3)] = is_high ? u : v;
    cell[static_cast<std::size_t>((axis + 2) % 3)] = is_high ? v : u;
    return index_of.at(cell);
  };
  for (int u = 0; u + 1 < kEdge; ++u) {
    for (int v = 0; v + 1 < kEdge; ++v) {
      faces.push_back({at(u, v), at(u + 1, v), at(u + 1, v + 1)});
      faces.push_back({at(u, v), at(u + 1, v + 1), at(u, v + 1)});
    }
  }
}

std::uint16_t quanta(double offset_m, double quantum_m) {
  const double count = std::isfinite(offset_m) ? std::clamp(offset_m / quantum_m, -kMaxQuanta, kMaxQuanta) : 0;
  return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(count)));
}

}  // namespace

const std::array<Vec3, kSoftLatticePoints>& soft_lattice() {
  static const auto kPoints = [] {
    std::array<Vec3, kSoftLatticePoints> points;
    std::ranges::transform(lattice_cells(), points.begin(), [](const Cell& cell) -> Vec3 {
      return Vec3(cell[0], cell[1], cell[2]) / (kEdge - 1) - Vec3::Constant(0.5);
    });
    return points;
  }();
  return kPoints;
}

const std::vector<std::array<int, 3>>& soft_lattice_faces() {
  static const auto kFaces = [] {
    std::map<Cell, int> index_of;
    for (const Cell& cell : lattice_cells()) index_of.emplace(cell, static_cast<int>(index_of.size()));
    // `index_of` is sorted differently from soft_lattice(). The indices are therefore assigned in the order of the
    // lattice.
    int next = 0;
    for (const Cell& cell : lattice_cells()) index_of[cell] = next++;
    std::vector<std::array<int, 3>> faces;
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool is_high : {false, true}) append_side(axis, is_high, index_of, faces);
    }
    return faces;
  }();
  return kFaces;
}

NearPlaces places_near(const Vec3& at, std::span<const Vec3> places) {
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  NearPlaces near{};
  const std::size_t count = std::min(near.size(), order.size());
  const auto is_nearer = [&](std::size_t a, std::size_t b) {
    return (places[a] - at).squaredNorm() < (places[b] - at).squaredNorm();
  };
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), is_nearer);
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    near.at(i) = {order[i], 1 / std::max((places[order[i]] - at).norm(), 1e-9)};
    sum += near.at(i).second;
  }
  for (std::size_t i = 0; i < count; ++i) near.at(i).second /= sum;
  return near;
}

std::vector<NearPlaces> soft_lattice_nodes(std::span<const Vec3> nodes) {
  Eigen::AlignedBox3d box;
  for (const Vec3& node : nodes) box.extend(node);
  std::vector<NearPlaces> near;
  for (const Vec3& share : soft_lattice()) {
    near.push_back(places_near(box.center() + share.cwiseProduct(box.sizes()), nodes));
  }
  return near;
}

void write_soft_shape(std::size_t soft_body, std::span<const Vec3> offsets_W, wire::SoftShape& out) {
  double largest_m = 0;
  for (const Vec3& offset : offsets_W) {
    if (offset.allFinite()) largest_m = std::max(largest_m, offset.cwiseAbs().maxCoeff());
  }
  const double quantum_m = std::clamp(largest_m / kMaxQuanta, kFinest_m, kMaxQuantum_m);
  std::string bytes;
  bytes.reserve(offsets_W.size() * kOffsetBytes);
  for (const Vec3& offset : offsets_W) {
    for (const double offset_m : offset) {
      const std::uint16_t count = quanta(offset_m, quantum_m);
      bytes.push_back(static_cast<char>(count & 0xFFU));
      bytes.push_back(static_cast<char>(count >> 8U));
    }
  }
  out.set_soft_body(static_cast<std::uint32_t>(soft_body));
  out.set_quantum_m(quantum_m);
  out.set_offsets(std::move(bytes));
}

std::optional<std::vector<Vec3>> read_soft_shape(const wire::SoftShape& message) {
  const std::string& bytes = message.offsets();
  const bool is_sound = message.quantum_m() >= kMinQuantum_m && message.quantum_m() <= kMaxQuantum_m &&
                        bytes.size() == kSoftLatticePoints * kOffsetBytes;
  if (!is_sound) return std::nullopt;
  std::vector<Vec3> offsets(kSoftLatticePoints);
  for (std::size_t i = 0; i < bytes.size() / 2; ++i) {
    const auto low = static_cast<std::uint8_t>(bytes[2 * i]), high = static_cast<std::uint8_t>(bytes[2 * i + 1]);
    const auto count = static_cast<std::int16_t>(static_cast<std::uint16_t>(low | (high << 8U)));
    offsets[i / 3][static_cast<Eigen::Index>(i % 3)] = count * message.quantum_m();
  }
  return offsets;
}

}  // namespace tandem::proto

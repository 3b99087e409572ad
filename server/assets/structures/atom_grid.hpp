// Search for nearby points by a grid of cubes. A cube stores a limited number of points, so that the work is bounded
// for any input.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::server {

class AtomGrid {
 public:
  /// In      cube_angstrom  edge of a cube: at least 0.5, and at least the largest distance of a search, because
  ///                        visit_near() visits only adjacent cubes
  AtomGrid(double cube_angstrom, const std::vector<Vec3>& positions) : cube_(cube_angstrom) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
      std::vector<std::uint32_t>& cell = cells_[key(cell_of(positions[i]))];
      if (cell.size() < kMaxPointsPerCube) cell.push_back(static_cast<std::uint32_t>(i));
    }
  }

  /// Calls `visit` with the index of each stored point within one cube edge of `position`, and of some points farther
  /// away.
  template <class Visit>
  void visit_near(const Vec3& position, const Visit& visit) const {
    const Cell centre = cell_of(position);
    for (int n = 0; n < 27; ++n) {
      const auto found = cells_.find(key(centre + Cell(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t i : found->second) visit(std::size_t{i});
    }
  }

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  /// Limit of points in a cube. A cube of 5 Å contains about 15 atoms in a valid file; damaged and hostile files may
  /// have any number.
  static constexpr std::size_t kMaxPointsPerCube = 100;

  Cell cell_of(const Vec3& position) const { return (position / cube_).array().floor().cast<std::int64_t>().matrix(); }
  static std::int64_t key(const Cell& cell) {
    constexpr std::int64_t kCells = std::int64_t{1} << 21;
    return (cell.x() * kCells + cell.y()) * kCells + cell.z();
  }

  double cube_;
  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace tandem::server

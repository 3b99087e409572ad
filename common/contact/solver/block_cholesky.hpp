// Solves the linear systems of the contact solver. The matrix consists of 6×6 blocks: block (i, k) couples the bodies i
// and k. All memory is preallocated.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::contact {

/// A symmetric positive definite matrix of n × n blocks, factored in place. Blocks that were never accessed are zero
/// and are skipped. Eigen's own factorisations are not used, because they allocate memory for matrices too large for
/// the stack.
class BlockCholesky {
 public:
  explicit BlockCholesky(std::size_t capacity);

  /// Sets a zero matrix of `blocks` × `blocks`, at most the capacity.
  void reset(std::size_t blocks) noexcept;
  /// Returns a block of the lower triangle (row ≥ column).
  Mat6& block(std::size_t row, std::size_t column) noexcept;

  /// Replaces the matrix by its factor. Returns false if it is not positive definite, or not finite.
  bool factor() noexcept;
  /// Replaces x by A⁻¹ x. Must be called after factor().
  void solve(std::span<Vec6> x) const noexcept;

 private:
  std::size_t index(std::size_t row, std::size_t column) const { return row * (row + 1) / 2 + column; }

  std::size_t blocks_ = 0;
  std::vector<Mat6> lower_;
  std::vector<std::uint8_t> is_used_;
};

}  // namespace tandem::contact

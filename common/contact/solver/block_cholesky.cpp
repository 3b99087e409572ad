#include "common/contact/solver/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace tandem::contact {

BlockCholesky::BlockCholesky(std::size_t capacity)
    : lower_(capacity * (capacity + 1) / 2, Mat6::Zero()), is_used_(lower_.size(), 0) {}

void BlockCholesky::reset(std::size_t blocks) noexcept {
  blocks_ = blocks;
  std::fill_n(is_used_.begin(), blocks * (blocks + 1) / 2, std::uint8_t{0});
}

Mat6& BlockCholesky::block(std::size_t row, std::size_t column) noexcept {
  const std::size_t at = index(row, column);
  if (is_used_[at] == 0) {
    is_used_[at] = 1;
    lower_[at].setZero();
  }
  return lower_[at];
}

bool BlockCholesky::factor() noexcept {
  for (std::size_t j = 0; j < blocks_; ++j) {
    Mat6& pivot = block(j, j);
    for (std::size_t k = 0; k < j; ++k) {
      if (is_used_[index(j, k)] == 0) continue;
      const Mat6& left = lower_[index(j, k)];
      pivot.noalias() -= left * left.transpose();
    }
    Eigen::LLT<Eigen::Ref<Mat6>> llt(pivot);
    if (llt.info() != Eigen::Success || !pivot.diagonal().allFinite()) return false;
    for (std::size_t i = j + 1; i < blocks_; ++i) {
      for (std::size_t k = 0; k < j; ++k) {
        if (is_used_[index(i, k)] == 0 || is_used_[index(j, k)] == 0) continue;
        block(i, j).noalias() -= lower_[index(i, k)] * lower_[index(j, k)].transpose();
      }
      if (is_used_[index(i, j)] == 0) continue;
      pivot.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(lower_[index(i, j)]);
    }
  }
  return true;
}

void BlockCholesky::solve(std::span<Vec6> x) const noexcept {
  for (std::size_t i = 0; i < blocks_; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (is_used_[index(i, k)] != 0) x[i].noalias() -= lower_[index(i, k)] * x[k];
    }
    lower_[index(i, i)].triangularView<Eigen::Lower>().solveInPlace(x[i]);
  }
  for (std::size_t i = blocks_; i-- > 0;) {
    for (std::size_t k = i + 1; k < blocks_; ++k) {
      if (is_used_[index(k, i)] != 0) x[i].noalias() -= lower_[index(k, i)].transpose() * x[k];
    }
    lower_[index(i, i)].triangularView<Eigen::Lower>().transpose().solveInPlace(x[i]);
  }
}

}  // namespace tandem::contact

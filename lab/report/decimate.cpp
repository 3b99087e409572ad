#include "lab/report/decimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tandem::lab {
namespace {

/// Indices of the samples that are kept in one pixel column.
struct PixelColumn {
  std::size_t number;
  std::size_t first;
  std::size_t lowest;
  std::size_t highest;
  std::size_t last;
};

void check_input(std::span<const double> x, std::span<const double> y, std::size_t columns) {
  if (columns == 0) throw std::invalid_argument("decimate: columns is 0; it must be at least 1");
  if (x.size() != y.size()) {
    throw std::invalid_argument("decimate: " + std::to_string(x.size()) + " x for " + std::to_string(y.size()) +
                                " y; there must be as many");
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || (i > 0 && x[i] < x[i - 1])) {
      throw std::invalid_argument("decimate: x[" + std::to_string(i) + "] is not finite or less than the one before");
    }
  }
}

class Decimator {
 public:
  Decimator(std::span<const double> x, std::span<const double> y) : x_(x), y_(y) {}

  void add(std::size_t i, std::size_t column) {
    if (!is_open_ || column_.number != column) {
      flush();
      if (has_gap_ || lines_.empty()) lines_.emplace_back();
      column_ = {column, i, i, i, i};
      is_open_ = true;
    }
    has_gap_ = false;
    if (y_[i] < y_[column_.lowest]) column_.lowest = i;
    if (y_[i] > y_[column_.highest]) column_.highest = i;
    column_.last = i;
  }
  void add_gap() { has_gap_ = true; }

  std::vector<Polyline> finish() {
    flush();
    return std::move(lines_);
  }

 private:
  void flush() {
    if (!is_open_) return;
    std::array<std::size_t, 4> kept = {column_.first, column_.lowest, column_.highest, column_.last};
    std::sort(kept.begin(), kept.end());
    const auto end = std::unique(kept.begin(), kept.end());
    for (auto i = kept.begin(); i != end; ++i) lines_.back().push_back({x_[*i], y_[*i]});
    is_open_ = false;
  }

  std::span<const double> x_;
  std::span<const double> y_;
  std::vector<Polyline> lines_;
  PixelColumn column_{};
  bool is_open_ = false;
  bool has_gap_ = false;
};

}  // namespace

std::vector<Polyline> decimate(std::span<const double> x, std::span<const double> y, Range x_range,
                               std::size_t columns) {
  check_input(x, y, columns);
  const double columns_per_x = static_cast<double>(columns) / (x_range.high - x_range.low);
  Decimator decimator(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] < x_range.low || x[i] > x_range.high) continue;
    if (!std::isfinite(y[i])) {
      decimator.add_gap();
      continue;
    }
    const auto column = static_cast<std::size_t>((x[i] - x_range.low) * columns_per_x);
    decimator.add(i, std::min(column, columns - 1));
  }
  return decimator.finish();
}

}  // namespace tandem::lab

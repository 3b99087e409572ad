// Writes and reads a distance grid: levels of bricks, distances at corners, and samples. They are quantized to small
// numbers and compressed. When a grid is read, all numbers are checked.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/progress.hpp"
#include "common/contact/field/brick_lattice.hpp"
#include "common/contact/field/distance_grid.hpp"
#include "common/geometry/packing.hpp"
#include "common/realtime/large_pages.hpp"

namespace tandem::contact {
namespace {

/// Valid ranges of lengths in a file [m]: 1 µm to 1 km for the edge of a brick, and ±1,000 km for a coordinate. Values
/// outside these ranges are refused.
constexpr double kSmallest = 1e-6;
constexpr double kMaxBrick = 1e3;
constexpr double kWorld = 1e6;
constexpr std::uint32_t kMaxBricksAlong = 1U << 16U;
/// A brick's samples are coded in passes from coarse to fine: one pass for the brick's corners, then four for midpoints
/// between samples that are already coded. This is the number of passes.
constexpr int kDepths = 5;
constexpr double kMaxCorner = 1 << 28;

bool is_between(double value, double low, double high) {
  return value >= low && value <= high;
}

bool is_in_world(const Vec3& p) {
  return p.cwiseAbs().maxCoeff() <= kWorld && p.allFinite();
}

/// Predicts the distance at a corner of the lattice from the seven neighbours that precede it, by trilinear
/// extrapolation.
class CornerPredictor {
 public:
  explicit CornerPredictor(const std::array<std::uint32_t, 3>& bricks)
      : row_(std::size_t{bricks[0]} + 1), plane_(row_ * (std::size_t{bricks[1]} + 1)) {}

  std::int64_t predict(const std::vector<std::int32_t>& corners, std::size_t at) const {
    const bool has_x = at % row_ > 0, has_y = at % plane_ >= row_, has_z = at >= plane_;
    const auto before = [&](bool is_present, std::size_t by) {
      return is_present ? std::int64_t{corners[at - by]} : 0;
    };
    return before(has_x, 1) + before(has_y, row_) + before(has_z, plane_) - before(has_x && has_y, 1 + row_) -
           before(has_x && has_z, 1 + plane_) - before(has_y && has_z, row_ + plane_) +
           before(has_x && has_y && has_z, 1 + row_ + plane_);
  }

 private:
  std::size_t row_;
  std::size_t plane_;
};

}  // namespace

int DistanceGrid::corner_quanta(std::size_t corner) const {
  const double quanta = std::round(static_cast<double>(corners_m_[corner]) / quantum_m_);
  return static_cast<int>(std::clamp(quanta, -kSampleSteps, kSampleSteps));
}

/// Returns the bricks with their levels and samples. While a grid is being read, the samples are not set yet.
BrickLattice DistanceGrid::lattice() const {
  BrickLattice lattice(bricks_);
  for (std::size_t i = 0; i < refs_.size(); ++i) {
    if (refs_[i] == 0) continue;
    Brick brick;
    brick.index = static_cast<std::uint32_t>(i);
    brick.level = level_of(refs_[i]);
    brick.samples.resize(samples_of(brick.level));
    const auto first = static_cast<std::ptrdiff_t>(refs_[i] >> kLevelBits);
    if (!samples_.empty()) std::copy_n(samples_.begin() + first, brick.samples.size(), brick.samples.begin());
    lattice.add(std::move(brick));
  }
  return lattice;
}

/// Copies the levels and samples of the bricks from the lattice into the grid.
/// Out     false if there are more samples than a grid can hold
bool DistanceGrid::set_lattice(const BrickLattice& lattice) {
  std::vector<std::uint8_t> levels(brick_total(), 0);
  std::size_t count = 0;
  for (const Brick& brick : lattice.bricks) {
    levels[brick.index] = static_cast<std::uint8_t>(brick.level + 1);
    count += brick.samples.size();
  }
  if (!set_levels(levels, count)) return false;
  samples_.clear();
  samples_.reserve(count);
  for (const Brick& brick : lattice.bricks) samples_.insert(samples_.end(), brick.samples.begin(), brick.samples.end());
  return true;
}

void DistanceGrid::write(std::vector<std::uint8_t>& bytes, int packing_level) const {
  ByteWriter writer(bytes);
  for (const std::uint32_t count : bricks_) writer.u32(count);
  for (const Vec3& p : {origin_S_, low_S_, high_S_}) writer.array(std::span<const double>(p.data(), 3));
  for (const double value : {brick_m_, quantum_m_, corner_quantum_m_, band_m_, error_m_}) writer.f64(value);
  writer.number(sample_step_);
  std::vector<std::uint8_t> levels(refs_.size());
  std::transform(refs_.begin(), refs_.end(), levels.begin(),
                 [](std::uint32_t ref) { return static_cast<std::uint8_t>(ref & ((1U << kLevelBits) - 1U)); });
  geometry::append_block(bytes, levels, packing_level);

  std::vector<std::uint8_t> numbers;
  std::vector<std::int32_t> corners(corners_m_.size());
  const CornerPredictor predictor(bricks_);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = static_cast<std::int32_t>(std::lround(static_cast<double>(corners_m_[i]) / corner_quantum_m_));
    geometry::append_number(numbers, static_cast<std::int32_t>(corners[i] - predictor.predict(corners, i)));
  }
  geometry::append_block(bytes, numbers, packing_level);

  std::array<std::vector<std::uint8_t>, kDepths> coded;
  const SampleCoding coding{sample_step_};
  BrickLattice lattice = this->lattice();
  lattice.code(
      coding, [this](std::size_t corner) { return corner_quanta(corner); },
      [&](int depth, int predicted, int sample) {
        const int r = coding.steps_to(sample, predicted);
        geometry::append_number(coded[static_cast<std::size_t>(depth)], r);
        return r;
      });
  for (const std::vector<std::uint8_t>& of_depth : coded) geometry::append_block(bytes, of_depth, packing_level);
}

bool DistanceGrid::read_header(ByteReader& reader) {
  for (std::uint32_t& count : bricks_) count = reader.u32();
  for (Vec3* p : {&origin_S_, &low_S_, &high_S_}) reader.array(std::span<double>(p->data(), 3));
  for (double* value : {&brick_m_, &quantum_m_, &corner_quantum_m_, &band_m_, &error_m_}) *value = reader.f64();
  sample_step_ = reader.number<std::uint16_t>();
  if (!reader.ok() || sample_step_ < 1) return false;
  // The product of the counts is computed only after each count was limited. Otherwise, it could overflow.
  const bool has_counts = std::all_of(bricks_.begin(), bricks_.end(),
                                      [](std::uint32_t count) { return count >= 1 && count <= kMaxBricksAlong; });
  if (!has_counts || brick_total() > kMaxBricks) return false;
  bricks_per_m_ = 1.0 / brick_m_;
  return is_between(brick_m_, kSmallest, kMaxBrick) && is_between(quantum_m_, 1e-15, kMaxBrick) &&
         is_between(corner_quantum_m_, 1e-15, kMaxBrick) && is_between(band_m_, 0, kMaxBrick) &&
         is_between(error_m_, 0, kMaxBrick) && is_in_world(origin_S_) && is_in_world(low_S_) && is_in_world(high_S_);
}

bool DistanceGrid::read_corners(ByteReader& reader, std::size_t limit_bytes) {
  const auto block = geometry::read_block(reader, limit_bytes);
  if (!block || block->size() < corner_total()) return false;
  std::span<const std::uint8_t> rest = *block;
  ByteReader numbers(rest);
  std::vector<std::int32_t> corners(corner_total());
  corners_m_.resize(corners.size());
  const CornerPredictor predictor(bricks_);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto corner = static_cast<double>(predictor.predict(corners, i) + geometry::pop_number(numbers));
    if (!is_between(corner, -kMaxCorner, kMaxCorner)) return false;
    corners[i] = static_cast<std::int32_t>(corner);
    corners_m_[i] = static_cast<float>(corner * corner_quantum_m_);
    if (!is_between(corners_m_[i], -kWorld, kWorld)) return false;
  }
  return numbers.ok() && rest.empty();
}

bool DistanceGrid::read_samples(ByteReader& reader, std::size_t limit_bytes) {
  std::array<std::vector<std::uint8_t>, kDepths> blocks;
  std::array<std::span<const std::uint8_t>, kDepths> rests;
  for (std::size_t depth = 0; depth < kDepths; ++depth) {
    call_off_point();
    auto block = geometry::read_block(reader, limit_bytes);
    if (!block) return false;
    limit_bytes -= block->size();
    blocks[depth] = std::move(*block);
    rests[depth] = blocks[depth];
  }
  std::array<ByteReader, kDepths> numbers{ByteReader(rests[0]), ByteReader(rests[1]), ByteReader(rests[2]),
                                          ByteReader(rests[3]), ByteReader(rests[4])};
  BrickLattice lattice = this->lattice();
  lattice.code(
      SampleCoding{sample_step_}, [this](std::size_t corner) { return corner_quanta(corner); },
      [&](int depth, int, int) { return geometry::pop_number(numbers[static_cast<std::size_t>(depth)]); });
  const bool is_whole = std::all_of(numbers.begin(), numbers.end(), [](const ByteReader& each) { return each.ok(); }) &&
                        std::all_of(rests.begin(), rests.end(), [](const auto& rest) { return rest.empty(); });
  return is_whole && set_lattice(lattice);
}

std::unique_ptr<DistanceGrid> DistanceGrid::read(std::span<const std::uint8_t>& bytes, std::size_t limit_bytes) {
  ByteReader reader(bytes);
  std::unique_ptr<DistanceGrid> grid(new DistanceGrid);
  if (!grid->read_header(reader)) return nullptr;
  const std::size_t lattice_bytes = grid->brick_total() * sizeof(std::uint32_t) + grid->corner_total() * sizeof(float);
  if (lattice_bytes > limit_bytes) return nullptr;
  const auto levels = geometry::read_block(reader, grid->brick_total());
  if (!levels || levels->size() != grid->brick_total()) return nullptr;
  std::size_t sample_count = 0;
  for (const std::uint8_t level : *levels) {
    if (level > kLevels) return nullptr;
    if (level > 0) sample_count += samples_of(level - 1U);
  }
  if (sample_count * sizeof(std::int16_t) > limit_bytes - lattice_bytes) return nullptr;
  // Bounds of the decompressed size, so that a malicious file cannot exhaust the memory. The first is the largest
  // number of bytes of a coded number. The second is the permitted mean number of bytes per sample; most samples need
  // one byte.
  constexpr std::size_t kMaxNumberBytes = 5;
  constexpr std::size_t kBytesPerSample = 3;
  const bool is_read = grid->set_levels(*levels, sample_count) &&
                       grid->read_corners(reader, kMaxNumberBytes * grid->corner_total()) &&
                       grid->read_samples(reader, kBytesPerSample * sample_count);
  if (!is_read) return nullptr;
  realtime::use_large_pages(std::as_bytes(std::span(grid->refs_)));
  realtime::use_large_pages(std::as_bytes(std::span(grid->samples_)));
  return grid;
}

}  // namespace tandem::contact

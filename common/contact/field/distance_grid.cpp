// Queries of the distance grid. They are the innermost loop of contact: each finds one brick, reads four short rows of
// samples, and needs no division.
#include "common/contact/field/distance_grid.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/contact/lanes/lanes.hpp"

namespace tandem::contact {
namespace {

// Range of the length of a gradient that is used unchanged. Shorter gradients occur on creases of the field and are
// replaced.
constexpr double kMinGradient = 0.1;
constexpr double kMaxGradient = 2.0;

/// Parameters for locating the cells of a grid.
struct GridCells {
  Vec3 origin_S;
  double bricks_per_m, quantum_m;
  std::array<std::int32_t, 3> bricks;
  const std::uint32_t* refs;
  const std::int16_t* samples;
};

}  // namespace
}  // namespace tandem::contact

// Two neighbouring samples are loaded as one 32-bit number, whose lower half is the first sample.
static_assert(std::endian::native == std::endian::little);
#define TANDEM_KERNEL "common/contact/lanes/grid_cells.inc"
#include "common/contact/lanes/twice.inc"

namespace tandem::contact {
namespace {

constexpr double kFarthestPlace_m = 1e6;
constexpr double kFarthest = 1e100;  ///< large distance whose square does not overflow

/// Eight neighbouring values and a position between them, 0..1 along each axis.
template <typename T>
struct Cell {
  const T* at;  ///< first of the values; its neighbours are at the offsets 1, `row` and `plane`
  std::size_t row;
  std::size_t plane;
  double x, y, z;
};

template <typename T>
double value(const Cell<T>& cell) {
  const auto mix = [](double a, double b, double t) { return a + t * (b - a); };
  const auto along_x = [&](const T* at) { return mix(at[0], at[1], cell.x); };
  const auto along_y = [&](const T* at) { return mix(along_x(at), along_x(at + cell.row), cell.y); };
  return mix(along_y(cell.at), along_y(cell.at + cell.plane), cell.z);
}

/// A value and its slope. They are scalars, because loading a vector right after storing its parts would stall the
/// processor.
struct Slope {
  double value, x, y, z;
};

/// Interpolates the value and its slope. The unit of the slope is value per edge of a cell.
template <typename T>
Slope value_and_slope(const Cell<T>& cell) {
  const auto& [at, row, plane, x, y, z] = cell;
  const double v000 = at[0];
  const double v010 = at[row];
  const double v001 = at[plane];
  const double v011 = at[plane + row];
  const double dx00 = at[1] - v000;
  const double dx10 = at[row + 1] - v010;
  const double dx01 = at[plane + 1] - v001;
  const double dx11 = at[plane + row + 1] - v011;
  const double v00 = v000 + x * dx00;
  const double v01 = v001 + x * dx01;
  const double dy0 = v010 + x * dx10 - v00;
  const double dy1 = v011 + x * dx11 - v01;
  const double v0 = v00 + y * dy0;
  const double dz = v01 + y * dy1 - v0;
  const double dx0 = dx00 + y * (dx10 - dx00);
  const double dx1 = dx01 + y * (dx11 - dx01);
  return {v0 + z * dz, dx0 + z * (dx1 - dx0), dy0 + z * (dy1 - dy0), dz};
}

/// Returns the cell that contains a position in a brick of `cells`³ cells.
Cell<std::int16_t> cell_of(const std::int16_t* samples, std::int32_t cells, const Vec3& in_brick) {
  // A position just below 1 may be rounded up to 1 by the scaling. It belongs to the last cell.
  const auto whole = [cells](double scaled) { return std::min(static_cast<std::int32_t>(scaled), cells - 1); };
  const double x = in_brick.x() * cells;
  const double y = in_brick.y() * cells;
  const double z = in_brick.z() * cells;
  const std::int32_t ix = whole(x);
  const std::int32_t iy = whole(y);
  const std::int32_t iz = whole(z);
  const std::int32_t row = cells + 1;
  return {samples + ((iz * row + iy) * row + ix),
          static_cast<std::size_t>(row),
          static_cast<std::size_t>(row * row),
          x - ix,
          y - iy,
          z - iz};
}

double with_sign_of(double sign, double magnitude) {
  return std::copysign(magnitude, sign);
}

bool is_usable(double squared_length) {
  return squared_length >= kMinGradient * kMinGradient && squared_length <= kMaxGradient * kMaxGradient;
}

Vec3 usable(const Vec3& gradient) {
  const double length = gradient.norm();
  if (is_usable(length * length)) return gradient;
  return length > kMaxGradient ? Vec3(gradient / length) : Vec3(Vec3::UnitZ());
}

}  // namespace

std::size_t DistanceGrid::brick_total() const {
  return std::size_t{bricks_[0]} * bricks_[1] * bricks_[2];
}

std::size_t DistanceGrid::corner_total() const {
  return (std::size_t{bricks_[0]} + 1) * (bricks_[1] + 1) * (bricks_[2] + 1);
}

/// Position of a point in the lattice: a brick, and coordinates in the brick.
struct DistanceGrid::Place {
  std::array<std::uint32_t, 3> brick;
  Vec3 in_brick;  ///< position in the brick, 0..1 along each axis
};

inline bool DistanceGrid::locate(const Vec3& p_S, Place& place) const noexcept {
  const double x = (p_S.x() - origin_S_.x()) * bricks_per_m_;
  const double y = (p_S.y() - origin_S_.y()) * bricks_per_m_;
  const double z = (p_S.z() - origin_S_.z()) * bricks_per_m_;
  if (!(x >= 0 && y >= 0 && z >= 0 && x < bricks_[0] && y < bricks_[1] && z < bricks_[2])) return false;
  const auto ix = static_cast<std::int32_t>(x);
  const auto iy = static_cast<std::int32_t>(y);
  const auto iz = static_cast<std::int32_t>(z);
  place.brick = {static_cast<std::uint32_t>(ix), static_cast<std::uint32_t>(iy), static_cast<std::uint32_t>(iz)};
  place.in_brick = {x - ix, y - iy, z - iz};
  return true;
}

inline const std::uint32_t& DistanceGrid::ref_at(const Place& place) const noexcept {
  return refs_[(std::size_t{place.brick[2]} * bricks_[1] + place.brick[1]) * bricks_[0] + place.brick[0]];
}

DistanceSample DistanceGrid::sample_corners(const Place& place) const noexcept {
  const std::size_t row = std::size_t{bricks_[0]} + 1;
  const std::size_t plane = row * (std::size_t{bricks_[1]} + 1);
  const Vec3& part = place.in_brick;
  const float* first = &corners_m_[place.brick[2] * plane + place.brick[1] * row + place.brick[0]];
  const Slope slope = value_and_slope(Cell<float>{first, row, plane, part.x(), part.y(), part.z()});
  return {slope.value, usable(Vec3(slope.x, slope.y, slope.z) * bricks_per_m_)};
}

double DistanceGrid::distance_to_bounds_m(const Vec3& p_S) const noexcept {
  return (low_S_ - p_S).cwiseMax(p_S - high_S_).cwiseMax(0.0).cwiseMin(kFarthest).norm();
}

double DistanceGrid::distance_m(const Vec3& p_S) const noexcept {
  Place place;
  if (!locate(p_S, place)) return distance_to_bounds_m(p_S);
  const std::uint32_t ref = ref_at(place);
  if (ref == 0) return far_distance_m(place);
  const std::uint32_t level = level_of(ref);
  const auto cells = static_cast<std::int32_t>(cells_of(level));
  const double distance = quantum_m_ * value(cell_of(&samples_[ref >> kLevelBits], cells, place.in_brick));
  if (std::abs(distance) <= band_m_) [[likely]]
    return distance;
  return with_sign_of(distance, std::max(band_m_, std::abs(distance) - slack_m(level)));
}

double DistanceGrid::far_distance_m(const Place& place) const noexcept {
  // Bound of the interpolation error. The distance d is interpolated between corners cᵢ with weights wᵢ. Because d has
  // the Lipschitz constant 1,
  // |d(p) − Σ wᵢ d(cᵢ)| ≤ Σ wᵢ |p − cᵢ| ≤ √(Σ wᵢ |p − cᵢ|²).
  // In units of a brick's edge, the last sum is Σ t (1 − t) over the axes, with the position t in the brick, 0 to 1.
  const double distance = sample_corners(place).distance_m;
  const double slack = brick_m_ * std::sqrt((place.in_brick.array() * (1.0 - place.in_brick.array())).sum());
  return with_sign_of(distance, std::max(band_m_, std::abs(distance) - slack));
}

inline DistanceSample DistanceGrid::sample_brick(const Place& place, std::uint32_t ref) const noexcept {
  if (ref == 0) return sample_corners(place);
  const auto cells = static_cast<std::int32_t>(cells_of(level_of(ref)));
  const Slope slope = value_and_slope(cell_of(&samples_[ref >> kLevelBits], cells, place.in_brick));
  const double per_cell = quantum_m_ * bricks_per_m_ * cells;
  const double x = slope.x * per_cell;
  const double y = slope.y * per_cell;
  const double z = slope.z * per_cell;
  // Where two sides are equally near, the slope may vanish. It is replaced by the slope of the coarse lattice of
  // corners, which points outwards there, too.
  if (!is_usable(x * x + y * y + z * z)) [[unlikely]]
    return {slope.value * quantum_m_, kMinGradient * sample_corners(place).gradient.normalized()};
  return {slope.value * quantum_m_, {x, y, z}};
}

DistanceSample DistanceGrid::sample(const Vec3& p_S) const noexcept {
  Place place;
  if (!locate(p_S, place)) return sample_outside(p_S);
  return sample_brick(place, ref_at(place));
}

// Samples all points that lie in bricks with samples. The other points get a NaN distance and must be sampled one by
// one.
void DistanceGrid::sample_cells(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept {
  const auto along = [this](std::size_t axis) { return static_cast<std::int32_t>(bricks_[axis]); };
  const GridCells cells{origin_S_,    bricks_per_m_,  quantum_m_, {along(0), along(1), along(2)},
                        refs_.data(), samples_.data()};
  (uses_avx2() ? avx2::sample_cells : portable::sample_cells)(cells, p_S.data(), (count + 3) / 4, samples.data());
}

void DistanceGrid::sample_all(const EightPlaces& p_S, std::size_t count, EightSamples& samples) const noexcept {
  sample_cells(p_S, count, samples);
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isnan(samples(static_cast<Eigen::Index>(i), 0))) set_sample(samples, i, sample(place_at(p_S, i)));
  }
}

void DistanceGrid::distances_m(const EightPlaces& p_S, std::size_t count, EightNumbers& distances_m) const noexcept {
  EightSamples samples;
  sample_cells(p_S, count, samples);
  for (std::size_t i = 0; i < count; ++i) {
    distances_m[i] = samples(static_cast<Eigen::Index>(i), 0);
    if (!(std::abs(distances_m[i]) <= band_m_)) distances_m[i] = distance_m(place_at(p_S, i));
  }
}

DistanceSample DistanceGrid::sample_outside(const Vec3& p_S) const noexcept {
  // A position with a NaN is in no brick. It gets a large distance.
  if (p_S.hasNaN()) return {kFarthest, Vec3::UnitZ()};
  const Vec3 p = p_S.cwiseMax(-kFarthestPlace_m).cwiseMin(kFarthestPlace_m);
  Place place;
  Vec3 border;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double scaled = std::clamp((p[i] - origin_S_[i]) * bricks_per_m_, 0.0, static_cast<double>(bricks_[axis]));
    place.brick[axis] = std::min(static_cast<std::uint32_t>(scaled), bricks_[axis] - 1);
    place.in_brick[i] = scaled - place.brick[axis];
    border[i] = origin_S_[i] + scaled * brick_m_;
  }
  const DistanceSample at_border = sample_corners(place);
  const Vec3 surface = border - at_border.gradient.normalized() * at_border.distance_m;
  const Vec3 away = p - surface;
  const double distance = away.norm();
  return {distance, distance > 0 ? Vec3(away / distance) : Vec3(Vec3::UnitZ())};
}

std::size_t DistanceGrid::brick_count(int cells) const {
  return static_cast<std::size_t>(std::count_if(refs_.begin(), refs_.end(), [cells](std::uint32_t ref) {
    const std::uint32_t level = ref & ((1U << kLevelBits) - 1U);
    return level > 0 && static_cast<int>(cells_of(level - 1)) == cells;
  }));
}

std::size_t DistanceGrid::memory_bytes() const {
  return sizeof(*this) + refs_.capacity() * sizeof(refs_[0]) + corners_m_.capacity() * sizeof(corners_m_[0]) +
         samples_.capacity() * sizeof(samples_[0]) + planes_.memory_bytes();
}

/// Computes the references of all bricks from their levels.
/// In      levels  for each brick: 0 if it has no samples, else level + 1
/// Out     false if the bricks do not have `sample_count` samples in total, or too many
bool DistanceGrid::set_levels(std::span<const std::uint8_t> levels, std::size_t sample_count) {
  refs_.resize(levels.size());
  finest_ = 0;
  coarsest_ = kLevels - 1;
  std::size_t first = 0;
  bool has_bricks = false;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    refs_[i] = 0;
    if (levels[i] == 0) continue;
    if (levels[i] > kLevels || first >= kFirstSampleLimit) return false;
    const std::uint32_t level = levels[i] - 1U;
    refs_[i] = static_cast<std::uint32_t>(first << kLevelBits) | levels[i];
    finest_ = std::max(finest_, level);
    coarsest_ = std::min(coarsest_, level);
    has_bricks = true;
    first += samples_of(level);
  }
  return has_bricks && first == sample_count;
}

}  // namespace tandem::contact

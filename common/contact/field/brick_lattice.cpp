#include "common/contact/field/brick_lattice.hpp"

#include <cmath>
#include <utility>

namespace tandem::contact {
namespace {

constexpr int kCorners = kBrickHalves;  ///< length of a brick's edge between two corners, in half cells

/// Predicts a sample: the mean of the two, four or eight coarser samples around the position.
int predicted_at(const Brick& brick, const Halves& at, int half_step) {
  std::array<int, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    reach[axis] = at[axis] % (2 * half_step) != 0 ? half_step : 0;
  }
  int sum = 0;
  for (int i = 0; i < 8; ++i) {
    const auto along = [&](std::size_t axis) { return (i >> axis & 1) != 0 ? reach[axis] : -reach[axis]; };
    sum += brick.samples[brick.offset(at[0] + along(0), at[1] + along(1), at[2] + along(2))];
  }
  // The sum always has eight terms: in the middle of an edge, for example, each of the two samples occurs four times.
  return (sum + 4) >> 3;
}

}  // namespace

BrickLattice::BrickLattice(const std::array<std::uint32_t, 3>& along)
    : along_(along), brick_at_(std::size_t{along[0]} * along[1] * along[2], -1) {}

void BrickLattice::add(Brick&& brick) {
  brick_at_[brick.index] = static_cast<std::int32_t>(bricks.size());
  bricks.push_back(std::move(brick));
}

void BrickLattice::code(const SampleCoding& coding, const std::function<int(std::size_t corner)>& corner_quanta,
                        const CodeSample& code_sample) {
  std::uint32_t finest = 0;
  for (const Brick& brick : bricks) finest = std::max(finest, brick.level);
  for (std::uint32_t level = 0; level <= finest; ++level) {
    for (Brick& brick : bricks) {
      if (brick.level == level) code_brick(brick, coding, corner_quanta, code_sample);
    }
  }
}

void BrickLattice::code_brick(Brick& brick, const SampleCoding& coding,
                              const std::function<int(std::size_t corner)>& corner_quanta,
                              const CodeSample& code_sample) {
  is_known_.assign(brick.samples.size(), 0);
  match_border(brick);
  int depth = 0;
  const auto code_at = [&](const Halves& at, int predicted) {
    std::int16_t& sample = brick.samples[brick.offset(at[0], at[1], at[2])];
    const int step = coding.step_at(predicted);
    const int most = (static_cast<int>(kSampleSteps) + std::abs(predicted)) / step;
    const int r = std::clamp(code_sample(depth, predicted, sample), -most, most);
    sample = static_cast<std::int16_t>(
        std::clamp(predicted + r * step, -static_cast<int>(kSampleSteps), static_cast<int>(kSampleSteps)));
  };
  const auto for_unknown = [&](int step, const auto& visit) {
    for (int z = 0; z <= kBrickHalves; z += step) {
      for (int y = 0; y <= kBrickHalves; y += step) {
        const bool is_new_row = z % (2 * step) != 0 || y % (2 * step) != 0;
        const int first = step == kCorners || is_new_row ? 0 : step;
        const int stride = step == kCorners || is_new_row ? step : 2 * step;
        for (int x = first; x <= kBrickHalves; x += stride) {
          if (is_known_[brick.offset(x, y, z)] == 0) visit({x, y, z});
        }
      }
    }
  };
  for_unknown(kCorners, [&](const Halves& at) { code_at(at, corner_quanta(corner_of(brick, at))); });
  for (int step = kCorners / 2; step >= step_of(brick.level); step /= 2) {
    ++depth;
    for_unknown(step, [&](const Halves& at) { code_at(at, predicted_at(brick, at, step)); });
  }
}

std::size_t BrickLattice::corner_of(const Brick& brick, const Halves& at) const {
  const auto [x, y, z] = position_of(brick.index);
  const auto next = [](int half) { return std::size_t{half == 0 ? 0U : 1U}; };
  const std::size_t row = std::size_t{along_[0]} + 1;
  return ((z + next(at[2])) * (std::size_t{along_[1]} + 1) + y + next(at[1])) * row + x + next(at[0]);
}

void BrickLattice::match_border(Brick& brick) {
  const int step = step_of(brick.level);
  const auto is_border = [](int position) { return position == 0 || position == kBrickHalves; };
  for (int z = 0; z <= kBrickHalves; z += step) {
    for (int y = 0; y <= kBrickHalves; y += step) {
      const int stride = is_border(z) || is_border(y) ? step : kBrickHalves;
      for (int x = 0; x <= kBrickHalves; x += stride) {
        Halves at_owner{};
        const Brick* owner = owner_of(brick, {x, y, z}, at_owner);
        if (owner == &brick) continue;
        const std::size_t offset = brick.offset(x, y, z);
        is_known_[offset] = 1;
        brick.samples[offset] = owner->level == brick.level
                                    ? owner->samples[owner->offset(at_owner[0], at_owner[1], at_owner[2])]
                                    : static_cast<std::int16_t>(std::lround(owner->interpolated_at(at_owner)));
      }
    }
  }
}

/// Returns the brick that codes the sample at a position on the border of `brick`: the coarsest of the bricks that
/// share the position, or the first of equally coarse ones.
/// Out     at_owner  position relative to the returned brick; not set if `brick` is returned
const Brick* BrickLattice::owner_of(const Brick& brick, const Halves& at, Halves& at_owner) const {
  const auto position = position_of(brick.index);
  const Brick* owner = &brick;
  for (int i = 1; i < 8; ++i) {
    std::array<std::uint32_t, 3> beside = position;
    Halves at_beside = at;
    bool is_present = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((i >> axis & 1) == 0) continue;
      const bool is_low = at[axis] == 0;
      // An index of −1 wraps around to the largest unsigned number, which is outside of the lattice and therefore
      // rejected.
      beside[axis] += is_low ? ~0U : 1U;
      at_beside[axis] = is_low ? kBrickHalves : 0;
      is_present = is_present && (is_low || at[axis] == kBrickHalves) && beside[axis] < along_[axis];
    }
    const std::int32_t place = is_present ? brick_at_[index_of(beside)] : -1;
    if (place < 0) continue;
    const Brick& other = bricks[static_cast<std::size_t>(place)];
    if (std::pair(other.level, other.index) >= std::pair(owner->level, owner->index)) continue;
    owner = &other;
    at_owner = at_beside;
  }
  return owner;
}

}  // namespace tandem::contact

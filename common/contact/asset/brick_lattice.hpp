// The bricks of a distance grid side by side: what they share, and their samples as few small numbers. Private to the
// building, writing and reading of grids.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <vector>

#include "common/contact/brick_sampler.hpp"

namespace tandem::contact {

/// How samples are coded: each as what it is beyond the mean of its coarser neighbours, in steps.
///
/// Model   r = round((s − p) / d), s' = p + r d; d = max(step, |p| / 128): near the surface within step/2 of the truth,
///         far from it within 0.4 % of the distance. p is of samples that have been coded before, s', so errors do not
///         add up; and what has been coded once stays as it is.
/// Source  after the lifting scheme: Sweldens, "The lifting scheme: a construction of second generation wavelets", 1998,
///         with linear prediction and without update
struct SampleCoding {
  int step = 1;  ///< quanta

  int step_at(int predicted) const { return std::max(step, std::abs(predicted) >> 7); }
  /// r.
  int steps_to(int sample, int predicted) const {
    const int step_here = step_at(predicted);
    const int beyond = sample - predicted;
    return (beyond >= 0 ? beyond + step_here / 2 : beyond - step_here / 2) / step_here;
  }
};

/// What a coder does with a sample: gives r, of one that is known or that it reads.
///
/// In      depth      0 for the corners of a brick, 1 for the middles between them, …
///         predicted  in quanta
///         sample     as it is; unspecified to one that reads
using CodeSample = std::function<int(int depth, int predicted, int sample)>;

class BrickLattice {
 public:
  BrickLattice() = default;
  explicit BrickLattice(const std::array<std::uint32_t, 3>& along);

  std::array<std::uint32_t, 3> position_of(std::uint32_t index) const {
    return {index % along_[0], index / along_[0] % along_[1], index / along_[0] / along_[1]};
  }
  std::uint32_t index_of(const std::array<std::uint32_t, 3>& position) const {
    return (position[2] * along_[1] + position[1]) * along_[0] + position[0];
  }
  /// In the order of their indices.
  void add(Brick&& brick);

  /// Makes all samples what coding leaves of them, the coarsest bricks first. A place that several bricks share is
  /// owned by the coarsest of them, of those the first; the others have there what the owner interpolates to, and code
  /// nothing.
  ///
  /// In      corner_quanta  predicted sample at a corner of the lattice
  void code(const SampleCoding& coding, const std::function<int(std::size_t corner)>& corner_quanta,
            const CodeSample& code_sample);

  std::vector<Brick> bricks;

 private:
  void code_brick(Brick& brick, const SampleCoding& coding, const std::function<int(std::size_t corner)>& corner_quanta,
                  const CodeSample& code_sample);
  /// Marks in `is_known_` what others own.
  void match_border(Brick& brick);
  const Brick* owner_of(const Brick& brick, const Halves& at, Halves& at_owner) const;
  std::size_t corner_of(const Brick& brick, const Halves& at) const;

  std::array<std::uint32_t, 3> along_ = {0, 0, 0};
  std::vector<std::int32_t> brick_at_;  ///< for each place, its index in bricks or −1
  std::vector<std::uint8_t> is_known_;  ///< of the brick that is coded
};

}  // namespace tandem::contact

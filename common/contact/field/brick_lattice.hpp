// Bricks (cubes of samples) of a distance grid with shared borders, and the coding of their samples as small numbers.
// Used only to build, write and read grids.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <vector>

#include "common/contact/field/brick_sampler.hpp"

namespace tandem::contact {

/// Quantization of samples: each is coded as its difference from the mean of its coarser neighbours, in steps.
///
/// Model   For a sample s with the prediction p, the coded number is r = round((s − p) / d). The decoded sample is
///         s' = p + r d, where d = max(step, |p| / 128). The error is at most step/2 near the surface, and 0.4 % of the
///         distance far from it. p is computed from decoded samples s', so errors do not accumulate. Coding decoded
///         samples again changes nothing.
/// Source  after the lifting scheme: Sweldens, "The lifting scheme: a construction of second generation wavelets",
///         1998, with linear prediction and without update
struct SampleCoding {
  int step = 1;  ///< quantization step near the surface, as a number of quanta

  int step_at(int predicted) const { return std::max(step, std::abs(predicted) >> 7); }
  /// Returns the coded number r of a sample.
  int steps_to(int sample, int predicted) const {
    const int step_here = step_at(predicted);
    const int beyond = sample - predicted;
    return (beyond >= 0 ? beyond + step_here / 2 : beyond - step_here / 2) / step_here;
  }
};

/// Function that codes or decodes one sample. It returns the coded number r: a coder computes r from the sample, a
/// decoder reads r.
///
/// In      depth      pass of coding: 0 for the corners of a brick, 1 for the midpoints between these, and so on
///         predicted  predicted value in quanta
///         sample     value before coding; unspecified when decoding
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
  /// Appends a brick; bricks must be added in the order of their indices.
  void add(Brick&& brick);

  /// Replaces all samples by their decoded values, so that the grid has the same samples as a decoder. If several
  /// bricks share a position, only one of them codes the sample there: the coarsest one, or the first of equally coarse
  /// ones. It is called the owner. The other bricks interpolate their sample from the owner. The coarsest bricks are
  /// therefore coded first.
  ///
  /// In      corner_quanta  returns the predicted sample at a corner of the lattice
  void code(const SampleCoding& coding, const std::function<int(std::size_t corner)>& corner_quanta,
            const CodeSample& code_sample);

  std::vector<Brick> bricks;

 private:
  void code_brick(Brick& brick, const SampleCoding& coding, const std::function<int(std::size_t corner)>& corner_quanta,
                  const CodeSample& code_sample);
  /// Sets the border samples of a brick that another brick owns, by interpolation in the owner. Marks them in
  /// `is_known_`.
  void match_border(Brick& brick);
  const Brick* owner_of(const Brick& brick, const Halves& at, Halves& at_owner) const;
  std::size_t corner_of(const Brick& brick, const Halves& at) const;

  std::array<std::uint32_t, 3> along_ = {0, 0, 0};
  std::vector<std::int32_t> brick_at_;  ///< for each position in the lattice: index in `bricks`, or −1
  std::vector<std::uint8_t> is_known_;  ///< for each sample of the current brick: whether another brick owns it
};

}  // namespace tandem::contact

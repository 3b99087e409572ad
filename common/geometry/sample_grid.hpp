// Spatial hash of surface samples. Samples can be added between searches.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/spatial.hpp"

namespace tandem::geometry {

/// A point on a surface with its normal: a candidate for a point of a point shell.
struct SurfaceSample {
  Eigen::Vector3f p_S = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_S = Eigen::Vector3f::Zero();
};

/// Samples hashed by the cube in which they lie.
class SampleGrid {
 public:
  /// In      reach_m  largest distance for which visit_near() finds all samples
  explicit SampleGrid(double reach_m) : cubes_per_m_(static_cast<float>(0.5 / (reach_m * (1 + 1e-5)))) {
    slots_.assign(1024, Slot{});
  }

  std::uint32_t add(const SurfaceSample& sample) {
    if (2 * used_slots_ >= slots_.size()) grow();
    const std::uint64_t key = key_of(sample.p_S * cubes_per_m_);
    Slot& slot = slots_[slot_of(slots_, key)];
    if (slot.first == kNone) ++used_slots_;
    const auto index = static_cast<std::uint32_t>(samples_.size());
    samples_.push_back(sample);
    next_.push_back(slot.first);
    slot = {key, index};
    return index;
  }

  std::span<const SurfaceSample> samples() const { return samples_; }

  /// Calls visit(index, sample) for every sample within the reach of `p_S`, and for some samples slightly farther away.
  template <typename Visit>
  void visit_near(const Eigen::Vector3f& p_S, Visit&& visit) const {
    // A cube is twice as wide as the reach. The eight cubes around the nearest lattice corner therefore contain every
    // sample within the reach.
    const Eigen::Vector3f low = p_S * cubes_per_m_ - Eigen::Vector3f::Constant(0.5F);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3f offset(static_cast<float>(corner & 1), static_cast<float>((corner >> 1) & 1),
                                   static_cast<float>(corner >> 2));
      for (std::uint32_t i = slots_[slot_of(slots_, key_of(low + offset))].first; i != kNone; i = next_[i])
        visit(i, samples_[i]);
    }
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t first = kNone;  ///< first sample of the cube; kNone: the slot is free
  };

  /// Packs the three indices of a cube into a key, with 21 bits for each. Distant cubes may get the same key by
  /// overflow. Their samples then share one list, so a search visits more samples but still finds all.
  static std::uint64_t key_of(const Eigen::Vector3f& cube) {
    const auto axis = [](float value) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(value))) & 0x1FFFFFU;
    };
    return axis(cube.x()) << 42U | axis(cube.y()) << 21U | axis(cube.z());
  }

  static std::size_t slot_of(const std::vector<Slot>& slots, std::uint64_t key) {
    const std::size_t mask = slots.size() - 1;
    // The high half of the product depends on all bits of the key. The shifts copy it to the low bits, which are used
    // as the index.
    const std::uint64_t product = key * 0x9E3779B97F4A7C15U;
    std::size_t at = static_cast<std::size_t>(product >> 32U ^ product >> 48U) & mask;
    while (slots[at].first != kNone && slots[at].key != key) at = (at + 1) & mask;
    return at;
  }

  void grow() {
    std::vector<Slot> wider(slots_.size() * 2);
    for (const Slot& slot : slots_) {
      if (slot.first != kNone) wider[slot_of(wider, slot.key)] = slot;
    }
    slots_ = std::move(wider);
  }

  float cubes_per_m_;
  std::vector<Slot> slots_;  // hash table; its size is a power of two
  std::size_t used_slots_ = 0;
  std::vector<SurfaceSample> samples_;
  std::vector<std::uint32_t> next_;  // next sample in the same cube
};

}  // namespace tandem::geometry

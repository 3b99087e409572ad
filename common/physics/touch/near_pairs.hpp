// Which shapes of the world's things are near each other in a step. Private to the touch stage.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/contact/contact_pair.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// Pairs of shapes of which one is an implicit thing's, each kept, with its friction, for as long as it is near.
class NearPairs {
 public:
  /// Shape part_a of thing_a, which is implicit, and part_b of thing_b.
  struct Pair {
    explicit Pair(std::uint32_t budget) : contacts(budget) {}
    contact::ContactPair contacts;
    std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
    double band_m = 0;     ///< how near its surfaces must be to be of interest
    double deepest_m = 0;  ///< in the last step, set by the stage; 0: nothing pressed
    bool is_used = false;
    bool is_near = false;
  };

  /// In      budget  points of a pair (contact::ContactPair)
  NearPairs(std::size_t pairs, std::uint32_t budget);
  ~NearPairs();

  /// Of too many pairs, those that press deepest stay, then those that were near before: kFaultContactCoarse.
  ///
  /// In      reach_m  how far each thing may get in this step
  TickFaults find(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// In a fixed order.
  std::span<Pair* const> near() const { return chosen_; }

 private:
  struct Near;

  bool add(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept;
  TickFaults choose_nearest() noexcept;
  void bind(std::span<const TouchThing> things) noexcept;

  std::vector<Pair> pairs_;
  std::size_t end_ = 0;     ///< no pair from here on is used
  std::vector<Near> near_;  ///< as found
  std::vector<Pair*> chosen_;
};

}  // namespace tandem::physics

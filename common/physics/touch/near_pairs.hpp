// Which shapes of the world's things are near each other in a step. Private to the touch stage.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/contact/contact_pair.hpp"
#include "common/physics/touch/touch_thing.hpp"

namespace tandem::physics {

/// Pairs of shapes of which one is an implicit thing's, each kept, with its friction, for as long as it is near. What a step
/// would look for may be found before it, when there is time (look_ahead()): it serves where things are the same, and still
/// where they were, and get no farther than was thought.
class NearPairs {
 public:
  /// Shape part_a of thing_a, which is implicit, and part_b of thing_b.
  struct Pair {
    explicit Pair(std::uint32_t budget) : contacts(budget) {}
    /// Contacts with the shapes at these poses: those found ahead, once, or those found now.
    contact::ContactWork find(const Pose& X_WSa, const Pose& X_WSb) noexcept;
    /// For the next find().
    void find_ahead(const Pose& X_WSa, const Pose& X_WSb) noexcept;

    contact::ContactPair contacts;
    std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
    double band_m = 0;     ///< how near its surfaces must be to be of interest
    double deepest_m = 0;  ///< in the last step, set by the stage; 0: nothing pressed
    bool is_used = false;
    bool is_near = false;
    // Of find_ahead().
    Pose X_WSa, X_WSb;
    double found_m = -1;  ///< the band; below 0: nothing
    contact::ContactWork work;
  };

  /// In      budget  points of a pair (contact::ContactPair)
  NearPairs(std::size_t things, std::size_t pairs, std::uint32_t budget);
  ~NearPairs();

  /// Of too many pairs, those that press deepest stay, then those that were near before: kFaultContactCoarse.
  ///
  /// In      reach_m  how far each thing may get in this step
  TickFaults find(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// For the next find(): in which things may get so far.
  void look_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// In a fixed order.
  std::span<Pair* const> near() const { return chosen_; }
  /// Corrects what Pair::find() found of `pair` where other shapes that are near cover the surface of one of its shapes.
  void join(std::span<const TouchThing> things, Pair& pair) noexcept;

 private:
  struct Near;
  struct Foreseen;
  /// A thing and one of its shapes.
  using PartName = std::pair<std::uint16_t, std::uint16_t>;

  TickFaults search(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  bool is_foreseen(std::span<const TouchThing> things, std::span<const double> reach_m) const noexcept;
  bool add(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept;
  TickFaults choose_nearest() noexcept;
  void bind(std::span<const TouchThing> things) noexcept;

  static constexpr std::size_t kMaxBeside = 32;

  std::vector<Pair> pairs_;
  std::size_t end_ = 0;     ///< no pair from here on is used
  std::vector<Near> near_;  ///< as found
  std::vector<Pair*> chosen_;
  /// All pairs that are near enough for join(), searched or not.
  std::vector<std::array<PartName, 2>> neighbours_;
  std::array<std::vector<contact::PlacedShape>, 2> beside_;  ///< of the pair in join(): shapes beside A, and beside B
  std::vector<Foreseen>
      foreseen_;  ///< each thing, at the last look_ahead(); none: it was not called, or not all had room
};

}  // namespace tandem::physics

// Broad phase: pairs of shapes of the world's things that are near each other. Private to the touch stage.
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

/// Pairs of near shapes with at least one implicit thing. A pair is kept, with its friction state, for as long as it is
/// near. look_ahead() searches for the next step in idle time. Its result is used if things and poses are unchanged and
/// no thing moves farther than predicted.
class NearPairs {
 public:
  /// Shape part_a of thing_a, which is implicit, and shape part_b of thing_b. Two implicit things keep their order.
  struct Pair {
    explicit Pair(std::uint32_t budget) : contacts(budget) {}
    /// Returns the contacts at these poses: once those of find_ahead(), else newly found ones.
    contact::ContactWork find(const Pose& X_WSa, const Pose& X_WSb) noexcept;
    /// Finds contacts for the next find().
    void find_ahead(const Pose& X_WSa, const Pose& X_WSb) noexcept;

    contact::ContactPair contacts;
    std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
    double band_m = 0;     ///< surfaces nearer than this are searched
    double deepest_m = 0;  ///< deepest contact of the last step, set by the stage; 0: nothing pressed
    bool is_used = false;
    bool is_near = false;
    // Input and result of find_ahead().
    Pose X_WSa, X_WSb;
    double found_m = -1;  ///< its band; below 0: no result
    contact::ContactWork work;
  };

  /// In      budget  contact points of a pair (contact::ContactPair)
  NearPairs(std::size_t things, std::size_t pairs, std::uint32_t budget);
  ~NearPairs();

  /// Finds the near pairs. Of too many pairs, those with the deepest contact stay, then those that were near before:
  /// kFaultContactCoarse.
  ///
  /// In      reach_m  limit of each thing's motion in this step
  TickFaults find(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// Searches for the next find(), with these limits of motion.
  void look_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// Near pairs in a fixed order.
  std::span<Pair* const> near() const { return chosen_; }
  /// Corrects the contacts of `pair` where other near shapes cover the surface of one of its shapes.
  void join(std::span<const TouchThing> things, Pair& pair) noexcept;

 private:
  struct Near;
  struct FoundThing;
  /// Index of a thing and of one of its shapes.
  using PartName = std::pair<std::uint16_t, std::uint16_t>;

  TickFaults search(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  bool is_found_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) const noexcept;
  bool add(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept;
  void match(std::span<const TouchThing> things) noexcept;
  TickFaults choose_nearest() noexcept;
  void bind(std::span<const TouchThing> things) noexcept;

  static constexpr std::size_t kMaxBeside = 32;

  std::vector<Pair> pairs_;
  std::size_t end_ = 0;     ///< no pair from this index on is used
  std::vector<Near> near_;  ///< result of the search
  std::vector<Pair*> chosen_;
  /// All pairs that are near enough for join(), whether searched or not.
  std::vector<std::array<PartName, 2>> neighbours_;
  std::array<std::vector<contact::PlacedShape>, 2> beside_;  ///< for the pair in join(): shapes beside A, and beside B
  std::vector<FoundThing>
      found_things_;  ///< each thing at the last look_ahead(); empty: it was not called, or not all pairs had room
};

}  // namespace tandem::physics

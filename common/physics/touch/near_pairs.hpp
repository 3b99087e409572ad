// Broad phase: finds the pairs of shapes of tools and bodies that are close to each other. Private to the touch stage.
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

/// Finds pairs of close shapes, at least one of which belongs to an implicit object (TouchThing::Role). As long as a
/// pair is close, its friction state is preserved. look_ahead() searches for the next step in idle time. Its result is
/// used only if the objects and their poses are unchanged in the step, and if no object moves farther than predicted.
class NearPairs {
 public:
  /// Shape part_a of thing_a and shape part_b of thing_b. At least one of the two objects is implicit. The order of the
  /// two objects does not change while the pair is close. A static object is always the second one.
  struct Pair {
    explicit Pair(std::uint32_t budget) : contacts(budget) {}
    /// Returns the contacts at the poses `X_WSa` and `X_WSb` of the shapes. If find_ahead() was called with the same
    /// poses and search distance, the first call returns its result. Otherwise the contacts are searched now.
    contact::ContactWork find(const Pose& X_WSa, const Pose& X_WSb) noexcept;
    /// Searches contacts in idle time, as a result for the next find().
    void find_ahead(const Pose& X_WSa, const Pose& X_WSb) noexcept;

    contact::ContactPair contacts;
    std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
    double band_m = 0;  ///< search distance: contacts are searched where the gap is below this
    /// Depth of the deepest contact with a force in the last step, set by the touch stage; 0: no contact had a force.
    double deepest_m = 0;
    bool is_used = false;
    bool is_near = false;
    // The following members are the input and the result of find_ahead().
    Pose X_WSa, X_WSb;
    double found_m = -1;  ///< search distance of find_ahead(); below 0: no result
    contact::ContactWork work;
  };

  /// In      budget  maximum number of contact points of a pair (contact::ContactPair)
  NearPairs(std::size_t things, std::size_t pairs, std::uint32_t budget);
  ~NearPairs();

  /// Finds the close pairs. If there are more than the capacity, returns kFaultContactCoarse; pairs with the deepest
  /// contact then have priority, followed by pairs that were close in the last step.
  ///
  /// In      reach_m  upper limit of each object's motion in this step
  TickFaults find(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// Searches in idle time for the next find(). `reach_m` is the predicted upper limit of each object's motion in that
  /// step.
  void look_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  /// Close pairs in a fixed order.
  std::span<Pair* const> near() const { return chosen_; }
  /// Corrects the contacts of `pair` where a third shape covers the surface of one of its shapes, because contacts
  /// under that cover are not real.
  void join(std::span<const TouchThing> things, Pair& pair) noexcept;

 private:
  struct Near;
  struct FoundThing;
  /// Index of an object and index of one of its shapes.
  using PartName = std::pair<std::uint16_t, std::uint16_t>;

  TickFaults search(std::span<const TouchThing> things, std::span<const double> reach_m) noexcept;
  bool is_found_ahead(std::span<const TouchThing> things, std::span<const double> reach_m) const noexcept;
  bool add(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept;
  void match(std::span<const TouchThing> things) noexcept;
  TickFaults choose_nearest() noexcept;
  void bind(std::span<const TouchThing> things) noexcept;

  static constexpr std::size_t kMaxBeside = 32;

  std::vector<Pair> pairs_;
  std::size_t end_ = 0;     ///< number of entries up to the last used pair
  std::vector<Near> near_;  ///< result of the search
  std::vector<Pair*> chosen_;
  /// All pairs that are close enough for join(), including those whose contacts are not searched.
  std::vector<std::array<PartName, 2>> neighbours_;
  std::array<std::vector<contact::PlacedShape>, 2> beside_;  ///< shapes beside A and shapes beside B, for join()
  std::vector<FoundThing>
      found_things_;  ///< each object at the last look_ahead(); empty: not called, or too many pairs
};

}  // namespace tandem::physics

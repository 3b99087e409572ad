// The joints between a user's copies of bodies and the server's bodies: how stiff they are, what share of the pull they
// are, and which end bears the weight. The server's room and the client's local model decide by the same rules, each
// from what it knows.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/time.hpp"
#include "common/physics/joints/joint.hpp"

namespace tandem::physics {

/// Whether another user has a hand on a body.
/// In      hands  how many are on it
///         has_own  this user's is one of them
constexpr bool others_touch(std::size_t hands, bool has_own) noexcept {
  return hands > (has_own ? 1U : 0U);
}

/// One end of the joint between a body at the server and its copy at a client, each pulled to where the other was.
///
/// Model   share      of all that pulls for the user: goes to 1 while the body is shared and back to 0 after, evenly in
///                    time and eased at both ends, so that the change is felt as no step
///         weight     what one user alone holds hangs in his hand, as it would without a network: his copy bears the
///                    weight, so that the joints, which are soft, have none to bear. Otherwise the server's body
///                    bears it, and hangs in all joints alike. It goes over evenly
/// Thread  the world's; no allocation
class DelayedJoint {
 public:
  /// Of the damper in the direction in which the tool presses, which keeps a thing between two hands; and how much of
  /// it over the one-way delay is the spring beside it.
  static constexpr double kAlongDamping_n_s_per_m = 32;
  static constexpr double kAlongStiffnessShare = 0.95;
  /// In all others: what is carried, and dragged along by 2 · share · damping.
  static constexpr double kAcrossDamping_n_s_per_m = 12;
  static constexpr double kAcrossStiffnessShare = 0.6;
  static constexpr double kMaxStiffness_n_per_m = 1200;  ///< however short the delay
  /// The rotational joint is that across at this distance: for a hand of 4e-4 kg·m² what 32 N·s/m is for one of 0.3 kg.
  static constexpr double kLever_m = 0.06;
  static constexpr double kRise_s = 0.1;        ///< of the share, from 0 to 1
  static constexpr double kFall_s = 0.2;        ///< and back
  static constexpr double kWeightTurn_s = 0.1;  ///< for all of a weight to go over

  /// What one end knows of the use of a body in a step.
  struct Use {
    bool is_shared = false;         ///< this user's hand is on it and another's
    bool is_held = false;           ///< by this user's tool
    std::size_t other_holders = 0;  ///< users beside this one whose tools hold it
  };

  /// In      shared_kept  a body counts as shared for so long after it was
  explicit DelayedJoint(Duration shared_kept = Duration{0}) : shared_kept_(shared_kept) {}

  /// How stiff it is.
  ///
  /// Model   k = share · b / T, T half of `loop`. A spring over a delay gives back k T of negative damping for each
  ///         end's motion; b takes it, and the hands take the rest. What moves evenly is dragged by k · v · 2T:
  ///         2 · share · b, whatever the delay, so across the pressing direction, where friction has to bear it, the
  ///         joint is softer.
  /// Source  the damper between copies: Sankaranarayanan, Hannaford, "Experimental comparison of internet haptic
  ///         collaboration with time-delay compensation techniques", ICRA 2008, for the scheme. The figures are ours:
  ///         one degree of freedom, two hands of 0.3 kg and 200 N/m on a body of 0.3 kg, loops of 25 to 300 ms. Calm
  ///         (≤ 2.7 mm/s) for b 20 to 40 N·s/m and shares of 0.4 to 1.0; at b 60 they ring, at 1.3 too.
  /// In      loop  from an input to its effect coming back, waiting included; shorter than 2 ms counts as that
  ///         slowest_loop  of all who touch the body: with it all are as soft across, and bear equal shares of weight
  ///         pressing_W  unit, or zero: the same in all directions, as across
  static Joint joint(Duration loop, Duration slowest_loop, const Vec3& pressing_W) noexcept;

  /// Once a step of the end's world, at `now`.
  /// In      weight_wait  who bears the weight has to be the same for so long before it goes over: until the other end
  ///                      does so too
  void step(Duration now, Duration period, const Use& use, Duration weight_wait = Duration{0}) noexcept;
  /// Joined wholly at once: a thing that followed the other end until now begins where that has it.
  void engage() noexcept { ramp_ = 1; }
  /// Not joined at once, and not shared any more.
  void disengage() noexcept;

  /// 0..1 of the pull on the body.
  double share() const noexcept { return ramp_ * ramp_ * (3 - 2 * ramp_); }
  /// 0..1 of the body's weight, to be borne by the copy as far as the joint has a share; by the server's body: the
  /// rest.
  double weight_on_copy() const noexcept { return weight_; }

 private:
  void step_weight(Duration now, double period_s, const Use& use, Duration wait) noexcept;

  Duration shared_kept_;
  Duration shared_until_{0};
  double ramp_ = 0;
  double weight_ = 0;
  double weight_goal_ = 0;
  Duration weight_goal_since_{0};
};

}  // namespace tandem::physics

// The part of a step in which tools, what they hold and what they touch are stepped together (common/contact). Private
// to the world.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/tick_faults.hpp"
#include "common/contact/contact_solver.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/physics/effects/effect.hpp"
#include "common/physics/joints/joint.hpp"
#include "common/physics/rigid_body.hpp"
#include "common/physics/tool_hand.hpp"
#include "common/physics/touch_model.hpp"

namespace tandem::physics {

/// Fluid round a massless thing, at the thing's origin: what slows it is solved for together with all else, because the
/// thing brings no velocity into the step.
struct TouchDrag {
  EffectDamping damping;
  Twist V_W;  ///< of the fluid
  double force_limit_n = 0;
  double torque_limit_n_m = 0;

  bool is_there() const { return damping.n_s_per_m > 0 || damping.n_m_s_per_rad > 0; }
  /// Another fluid in the same place: dampings and limits add up, velocities mix by damping.
  void add(const EffectDamping& more, const Twist& V_more_W, double more_force_n, double more_torque_n_m) noexcept;
};

/// One rigid thing of the world, as it is in this step.
struct TouchThing {
  /// kAbsent: not there. kOurs: moved by this stage alone. kGuest: one of the FreeBodies; in the step in which
  /// something of ours first touches it, the stage accounts for its inertia and hands the contacts' wrench on. kStatic:
  /// does not move.
  enum class Role : std::uint8_t { kAbsent, kOurs, kGuest, kStatic };

  RigidBody* rigid = nullptr;
  const TouchModel* model = nullptr;
  Role role = Role::kAbsent;
  bool is_led = false;      ///< a tool, or held by one, or else surely of ours: what it touches becomes ours too
  std::uint32_t hands = 0;  ///< bit i: it is tool i, or held by it
  /// Of ours only. kMassless: moves to where its coupling, contacts and wrench_W balance, and has no velocity after.
  /// kAtHandle: is taken to where its pulls say, each of which is shown an equal share of what bears on it.
  haptics::ToolDynamics dynamics = haptics::ToolDynamics::kWithMass;
  Wrench wrench_W = {};                            ///< weight and fields, about the centre of mass
  std::optional<std::size_t> passes_through = {};  ///< a thing that it does not touch
  TouchDrag drag = {};                             ///< of a massless one only
};

/// One tool's coupling; `wrench_W` is the answer: what the hand does to the tool, about the tool's origin at the end of
/// the step.
struct TouchPull {
  std::size_t thing = 0;
  const ToolHand* hand = nullptr;
  Pose X_WT;
  Wrench wrench_W;
};

/// A joint that pulls a thing, or an anchor; `wrench_W` is the answer: what it did to the thing, about the origin of
/// the frame that it pulls, at the end of the step.
struct TouchTie {
  std::size_t thing = 0;
  const JointLaw* law = nullptr;
  RigidState target;
  Pose X_WT;               ///< of the frame, fixed to the thing
  Wrench wrench_W = {};    ///< zero, too, for a guest that nothing touched
  bool is_solved = false;  ///< false: of such a guest, and of no effect
};

/// What a thing of ours felt in the last step.
struct TouchContact {
  std::uint32_t pressing = 0;  ///< contact points with a force
  double deepest_m = 0;
  bool is_reached = false;  ///< a led thing, or pressed by one, directly or through others
  std::uint32_t hands = 0;  ///< of the led things that reach it, or that it is
  Wrench wrench_W;          ///< of all contacts on it, about the origin of W
  Twist V_WC;               ///< with which its centre went through the step; a massless thing has no other velocity
};

/// How two things pressed on each other in the last step.
struct TouchBetween {
  double normal_force_n = 0;     ///< sum of the magnitudes
  Vec3 normal_W = Vec3::Zero();  ///< mean, unit, out of the second thing; zero: no contact
};

/// Contact and coupling of one step.
///
/// Third law: what a contact does to a thing of ours and to a guest is one number with two signs; the guest gets it as
/// an outside force (RigidBody::apply_wrench()).
class TouchStage {
 public:
  struct Limits {
    std::size_t things = 80;
    std::size_t pulls = 16;
    std::size_t ties = 16;
    std::size_t pairs = 64;         ///< pairs of shapes near each other at a time
    contact::ContactBudget budget;  ///< of a pair
    double speed_m_per_s = 10;
  };
  explicit TouchStage(const Limits& limits);

  /// Moves the things of ours by `step_s` and pushes the guests. No allocation.
  TickFaults step(double step_s, std::span<TouchThing> things, std::span<TouchPull> pulls,
                  std::span<TouchTie> ties) noexcept;

  /// Of a thing of ours in the last step.
  const TouchContact& contact(std::size_t thing) const { return felt_[thing]; }
  /// Of `thing` on `other` in the last step. Cost: the pairs that were near.
  TouchBetween between(std::size_t thing, std::size_t other) const noexcept;

 private:
  /// Which shape of which thing.
  struct Key {
    std::uint16_t thing_a = 0, part_a = 0, thing_b = 0, part_b = 0;
    bool operator==(const Key&) const = default;
  };
  struct Slot {
    explicit Slot(const contact::ContactBudget& budget) : pair(budget) {}
    contact::ContactPair pair;
    Key key;
    bool is_used = false;
    bool is_near = false;
    double deepest_m = 0;  ///< in the last step; 0: nothing pressed
  };
  struct Near {
    Key key;
    double band_m = 0;
    Slot* slot = nullptr;

    double deepest_m() const { return slot == nullptr ? 0 : slot->deepest_m; }
  };

  /// How pulls move a thing whose mass does not matter.
  struct Lead {
    int hands = 0;
    Twist V_WC;                ///< of a thing at the handle
    double mass_kg = 0;        ///< stands for none, of a massless one
    double inertia_kg_m2 = 0;  ///< likewise
    double reach_m = 0;
    Vec3 lever_W;  ///< from the centre to the tool's origin, of a thing with one hand
  };

  TickFaults follow_hands(double step_s, std::span<const TouchThing> things, std::span<const TouchPull> pulls) noexcept;
  void follow_ties(double step_s, std::span<const TouchThing> things, std::span<const TouchTie> ties) noexcept;
  void predict_reach(double step_s, std::span<const TouchThing> things, std::span<const TouchPull> pulls,
                     std::span<const TouchTie> ties) noexcept;
  void gain(double step_s, const TouchThing& thing, std::size_t index,
            const contact::SolverCoupling& coupling) noexcept;
  TickFaults find_near(std::span<const TouchThing> things) noexcept;
  bool add_near(std::span<const TouchThing> things, std::size_t a, std::size_t b, double band_m) noexcept;
  TickFaults choose_nearest() noexcept;
  void bind_slots(std::span<const TouchThing> things) noexcept;
  void find_reached(std::span<const TouchThing> things) noexcept;
  TickFaults find_contacts(std::span<const TouchThing> things) noexcept;
  void add_body(std::span<const TouchThing> things, std::size_t thing) noexcept;
  void add_patch(std::span<const TouchThing> things, const Near& near) noexcept;
  double massless_reach_m(double step_s, const TouchThing& thing, const Lead& lead) const noexcept;
  void add_couplings(std::span<const TouchThing> things, std::span<const TouchPull> pulls,
                     std::span<const TouchTie> ties) noexcept;
  void add_drags(std::span<const TouchThing> things) noexcept;
  bool is_solved_for(std::span<const TouchThing> things, const TouchTie& tie) const noexcept;
  TickFaults solve(double step_s, std::span<const TouchThing> things, std::span<TouchPull> pulls,
                   std::span<TouchTie> ties) noexcept;
  void feel() noexcept;
  void show_contacts(double step_s, std::span<const TouchThing> things, std::span<TouchPull> pulls,
                     std::span<TouchTie> ties) const noexcept;
  TickFaults write_back(double step_s, std::span<TouchThing> things) noexcept;

  Limits limits_;
  std::vector<Slot> slots_;
  std::size_t slots_end_ = 0;  ///< none from here on is used
  std::vector<Near> near_;
  std::vector<TouchContact> felt_;
  std::vector<Twist> gained_;       ///< by couplings, weight and fields in this step, of each thing
  std::vector<Lead> leads_;         ///< of each thing
  std::vector<double> reach_m_;     ///< how far each thing may get in this step
  std::vector<int> body_of_thing_;  ///< index of the solver's body, or kStaticBody
  std::vector<std::size_t> thing_of_body_;
  std::vector<contact::SolverBody> bodies_;
  std::vector<contact::SolverCoupling> couplings_;  ///< of pulls, then of ties, then of drags
  std::vector<haptics::SpringDamper> drag_laws_;
  std::vector<Wrench> tool_wrenches_;
  std::vector<contact::SolverPatch> patches_;
  std::vector<Slot*> patch_slots_;
  std::vector<contact::PatchResult> results_;
  contact::ContactSolver solver_;
};

}  // namespace tandem::physics

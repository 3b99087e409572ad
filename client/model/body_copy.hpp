// A movable body in the local model. It is either implicit (stepped by the model and reconciled with the server's
// states) or followed (set to the server's states).
#pragma once

#include "client/model/input_history.hpp"
#include "client/model/reconciler.hpp"
#include "common/net/playout.hpp"
#include "common/physics/world.hpp"

namespace tandem::client {

/// Values of the present step that several parts of the local model need.
struct ModelStep {
  physics::World& world;
  std::size_t tool = 0;  ///< index of this user's tool in the world
  BodyId held;           ///< body that this user's tool holds
  double period_s = 0.001;
  Duration loop_delay{0};  ///< delay from an input to the use of the server's answer, see LocalModel::loop_delay()
  Duration played{0};      ///< server time of the state that is displayed now, see net::PlayoutDelay
  Duration present{0};     ///< current server time, estimated
  Duration longest_extrapolation{0};    ///< limit of the extrapolated time of followed bodies
  double farthest_extrapolation_m = 0;  ///< limit of the extrapolated distance of followed bodies
  double grip_step_m = 0;               ///< maximum correction of a grip point in this step
};

/// The model's copy of one body, with the states received for the body.
///
/// Invariants  A body is absent from the world until the server has sent its state. A body is implicit while a tool
///             touches it. After a touch by this user's tool, it remains implicit for the loop delay plus 0.25 s. By
///             then the server's states include the effect of the touch. When the body begins to follow the server, its
///             pose does not jump: the offset from the server's pose fades
/// Thread      haptic: no allocation, no throw
class BodyCopy {
 public:
  BodyCopy(BodyId id, const ReconcilerSettings& settings) : id_(id), reconciler_(settings) {}

  BodyId id() const { return id_; }
  /// Returns true if the server has sent this body's state.
  bool is_known() const { return is_known_; }
  /// Returns the body's pose at the server at the time `played`, interpolated between received states.
  Pose pose_at(Duration played) const { return track_.at(played).X; }
  /// Returns the distance between the body's poses in model and server [m]. Returns 0 unless the body is implicit and
  /// this user's tool touches it.
  double touched_error_m() const;

  /// Removes the body from the world. It returns with its next state from the server.
  void forget(physics::World& world) noexcept;
  /// Adds a state received from the server.
  /// In      then  the model's state of this body at the input that the received state answers; null if that state is
  ///         not known
  void receive(Duration stepped, const RigidState& received, const BodyThen* then, physics::World& world) noexcept;
  /// Updates the times since any tool, and since this user's tool, last held or touched the body.
  void follow_touches(const ModelStep& step) noexcept;
  /// Corrects the body if it is implicit. Otherwise sets it to the server's state, extrapolated to the current server
  /// time.
  /// In      is_partners  true: the body is held only by another user (partner). It is not corrected, because this user
  ///                      would feel the correction as a force of the partner
  void move(const ModelStep& step, bool is_partners) noexcept;
  /// If the body is implicit, resets it to the server's newest state.
  void restart(physics::World& world) noexcept;
  /// Returns the body's state for the input history.
  BodyThen recorded(const physics::World& world) const { return {world.body(id_), reconciler_.given(), !is_followed_}; }

 private:
  bool is_implicit(Duration loop_delay) const noexcept;
  void reconcile(const ModelStep& step, bool is_partners) noexcept;
  RigidState seen_at_present(const ModelStep& step) const noexcept;
  void follow(const ModelStep& step) noexcept;

  BodyId id_;
  net::RigidTrack track_;
  Reconciler reconciler_;
  bool is_known_ = false;
  double unpressed_s_ = 1e9;  ///< time since any tool last touched or held the body [s]; initially very long
  double untouched_s_ = 1e9;  ///< time since this user's tool last touched or held the body [s]; initially very long
  Shift offset_;              ///< remaining offset from the server's state; fades while the body is followed
  bool is_followed_ = false;
};

}  // namespace tandem::client

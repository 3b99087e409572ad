// A movable body in the local model. It is either implicit (stepped by the model and reconciled with the server) or
// followed (set to the server's states).
#pragma once

#include "client/model/input_history.hpp"
#include "client/model/reconciler.hpp"
#include "common/net/playout.hpp"
#include "common/physics/world.hpp"

namespace tandem::client {

/// One step of the local model, as its parts use it.
struct ModelStep {
  physics::World& world;
  std::size_t tool = 0;  ///< the user's own tool
  BodyId held;           ///< body that it holds
  double period_s = 0.001;
  Duration loop_delay{0};             ///< LocalModel::loop_delay()
  Duration played{0};                 ///< server time in use (net::PlayoutDelay)
  Duration present{0};                ///< server time now
  Duration longest_extrapolation{0};  ///< limits of the extrapolation of followed bodies
  double farthest_extrapolation_m = 0;
  double grip_step_m = 0;  ///< limit of a grip's correction in this step
};

/// The model's copy of one body, with its received states.
///
/// Invariants  A body is absent from the world until the server has sent its state. It is implicit while a tool touches
///             it, and for a loop delay afterwards, so that the server's answer to the touch has arrived when the body
///             begins to follow. It then begins at its pose in the model; the offset to the server's pose fades.
/// Thread      haptic: no allocation, no throw
class BodyCopy {
 public:
  BodyCopy(BodyId id, const ReconcilerSettings& settings) : id_(id), reconciler_(settings) {}

  BodyId id() const { return id_; }
  /// True if the server has sent its state.
  bool is_known() const { return is_known_; }
  /// Pose at the server, played out.
  Pose pose_at(Duration played) const { return track_.at(played).X; }
  /// Distance between model and server while the user's tool touches the implicit body; else 0 [m].
  double touched_error_m() const;

  /// Adds a state of the server.
  /// In      then  this body at the input that the state answers; null: not known
  void receive(Duration stepped, const RigidState& received, const BodyThen* then, physics::World& world) noexcept;
  /// Measures the time since any tool, and since the user's own tool, last held or pressed the body.
  void follow_touches(const ModelStep& step) noexcept;
  /// Corrects an implicit body, or sets a followed one to its played state, extrapolated to the present.
  /// In      is_partners  only a partner holds it: a correction would be felt as the partner's force
  void move(const ModelStep& step, bool is_partners) noexcept;
  /// Sets an implicit body to the server's newest state.
  void restart(physics::World& world) noexcept;
  /// State for the input history.
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
  double unpressed_s_ = 1e9;  ///< time since any tool last pressed or held it [s]
  double untouched_s_ = 1e9;  ///< time since this user's tool last held or pressed it [s]
  Shift offset_;              ///< remaining offset to its pose before it began to follow the server
  bool is_followed_ = false;
};

}  // namespace tandem::client

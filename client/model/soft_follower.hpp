// Contact of soft bodies with this user's tool: evaluates the linearised contact from the server at 1 kHz, between two
// updates.
#pragma once

#include "common/base/ids.hpp"
#include "common/physics/soft_contact.hpp"

namespace tandem::client {

/// Evaluates the newest linearised contact at the tool's current pose, and blends smoothly from the previous contact to
/// it.
///
/// Model   W = W_received(X) + e, with the tool's pose X. When a new contact is received, e is set so that W does not
///         change. Then e decays like a critically damped spring, so the steps of the soft bodies (60 Hz) are not felt.
///         The first touch is not late, because the server predicts it (PredictedSoftContact). The force is never
///         attractive.
/// Limits  If the soft body moves by itself, its contact force is late by the delay and the decay time of e. This also
///         holds for the end of a contact from which the soft body moves away
/// Thread  haptic: no allocation, no throw
class SoftFollower {
 public:
  /// Sets the body on which the contact acts: the held body, or the tool itself if the id is invalid. If this differs
  /// from the previous call, the contact is discarded.
  void attach_to(BodyId held) noexcept;
  /// Sets the newest received contact, for the tool or held body at `X_WT`.
  void receive(const SoftContact& received, const Pose& X_WT) noexcept;
  /// Returns the wrench on the tool or held body for the next period, about its origin and in W.
  Wrench step(const Pose& X_WT, double period_s) noexcept;

 private:
  BodyId held_;
  SoftContact received_;
  Wrench left_, left_rate_;  ///< fading difference e and its rate of change
};

}  // namespace tandem::client

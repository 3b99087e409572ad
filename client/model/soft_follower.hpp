// Contact of soft bodies with the user's own tool between the server's updates: their linearised contact, evaluated at
// 1 kHz.
#pragma once

#include "common/base/ids.hpp"
#include "common/physics/soft_contact.hpp"

namespace tandem::client {

/// Evaluates the newest linearised contact at the tool's current pose and blends smoothly from the previous one.
///
/// Model   W = W_received(X) + e. A new contact changes e so that W does not change. Then e decays like a critically damped
///         spring, so the steps of the soft bodies (60 Hz) are not felt. The first touch is not late, because the
///         server predicts it (PredictedSoftContact). The force never pulls.
/// Limits  motion of the soft body by itself, or by other users, is late by the delay and the decay of e. The end of a
///         contact is also late when the soft body moves away from the tool.
/// Thread  haptic: no allocation, no throw
class SoftFollower {
 public:
  /// Sets the body that the contact acts on: the held one, or invalid for the tool itself. For another one than before
  /// the contact is discarded.
  void attach_to(BodyId held) noexcept;
  /// Sets the newest received contact, for the tool or held body at `X_WT`.
  void receive(const SoftContact& received, const Pose& X_WT) noexcept;
  /// Returns the wrench on the tool or held body about its origin, in W, for the next period.
  Wrench step(const Pose& X_WT, double period_s) noexcept;

 private:
  BodyId held_;
  SoftContact received_;
  Wrench left_, left_rate_;  ///< e and its derivative
};

}  // namespace tandem::client

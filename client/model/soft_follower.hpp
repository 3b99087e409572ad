// What soft bodies do to the user's own tool, between what the server says of it: their linearised contact, felt at
// 1 kHz.
#pragma once

#include "common/physics/soft_contact.hpp"

namespace tandem::client {

/// Feels the newest contact at once as the tool moves; goes smoothly from what an older one said to what it says.
///
/// Model   W = W_told(X) + e. A new contact changes e so that W does not change; e then goes to zero as a critically
///         damped spring does, so the steps of the soft bodies (60 Hz) are not felt. A touch is there before the server
///         has heard of it, for the server predicts it (PredictedSoftContact). Never pulls.
/// Limits  what the soft body does by itself, or under others' hands, comes late by the delay and the settling of e; so
///         does its end, when it is taken away from the tool
/// Thread  haptic: no allocation, no throw
class SoftFollower {
 public:
  /// The newest contact as the server tells it, for the thing at `X_WT` here.
  void take(const SoftContact& told, const Pose& X_WT) noexcept;
  /// On the thing about its origin, in W; for the next period.
  Wrench step(const Pose& X_WT, double period_s) noexcept;

 private:
  SoftContact told_;
  Wrench left_, left_rate_;  ///< e and its derivative
};

}  // namespace tandem::client

// Passivity controller of the hand's port, with a gradual transition when the user switches it on or off.
#pragma once

#include <atomic>

#include "client/exchange/mailboxes.hpp"
#include "common/haptics/passivity/hand_passivity_controller.hpp"

namespace tandem::client {

/// Passivity controller that fades in and out within 0.3 s, so that switching causes no force step.
/// Invariants  After the controller was on for the first time, it keeps its energy account even while it is faded out.
///             So the account is correct when the controller is switched on again. Before that, no account is kept and
///             the wrench passes unchanged
/// Thread      haptic except switch_to(): no allocation, no throw
class FadedPassivity {
 public:
  /// In      keeps_account  true: updates the energy account even if the controller has never been on
  FadedPassivity(bool is_on, bool keeps_account) noexcept;

  /// Switches the controller on or off, effective from the next apply() on.
  /// Thread  any
  void switch_to(bool is_on) noexcept { is_on_.store(is_on, std::memory_order_relaxed); }

  /// Adds the energies that the server reports in a state update. Must be called once for each received update.
  /// In      has_model  see HandPassivityController::world_reported()
  void receive(const ReceivedUpdate& received, bool has_model) noexcept;
  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH                 pose of the hand in the world without the offset of the clutch; null if the pose is
  ///                              unknown or the scene is unusable
  ///         energy_from_local_j  StageOutput::energy_from_local_j
  Wrench apply(const Pose* X_WH, const Wrench& stage_on_hand_W, double energy_from_local_j, double period_s) noexcept;
  /// Reports the wrench that was displayed after safety chain, clamp and device.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// Must be called if the hand's pose has jumped or is unknown, so that the jump counts as no work.
  void lose_hand() noexcept { controller_.lose_hand(); }
  /// Discards the energies of the local model, because the next values are those of a new local model.
  void forget_local_model() noexcept { controller_.forget_local_model(); }
  /// Resets the controller at the start of a new scene.
  void reset() noexcept { controller_.reset(); }

  /// Returns the fraction of the stage's wrench that passes the controller; 1 while the controller is faded out.
  double gain() const noexcept { return 1 + share_ * (controller_.gain() - 1); }
  const haptics::HandPassivityController& controller() const noexcept { return controller_; }

 private:
  void fade(double period_s) noexcept;

  std::atomic<bool> is_on_;
  double share_;  ///< weight of the controlled wrench in the output, 0 to 1; the uncontrolled wrench has 1 - share_
  bool keeps_account_;
  haptics::HandPassivityController controller_;
  LocalTime reported_at_{};  ///< reception time of the last energy report
};

}  // namespace tandem::client

// The passivity controller of the hand's port, with its fade when the user switches it.
#pragma once

#include <atomic>

#include "client/exchange/mailboxes.hpp"
#include "common/haptics/passivity/hand_passivity_controller.hpp"

namespace tandem::client {

/// Passivity controller that fades in and out within 0.3 s, so that switching it causes no force step.
///
/// Invariants  Once on, the energy account is kept even while the controller is faded out, so that it is correct when
///             the controller returns. Without an account the wrench passes unchanged.
/// Thread      haptic except switch_to(): no allocation, no throw
class FadedPassivity {
 public:
  /// In      keeps_account  true: keeps the account although the controller has never been on
  FadedPassivity(bool is_on, bool keeps_account) noexcept;

  /// Switches the controller from the next apply() on.
  /// Thread  any
  void switch_to(bool is_on) noexcept { is_on_.store(is_on, std::memory_order_relaxed); }

  /// Adds the energies of a received state; once for each.
  /// In      has_model  as in HandPassivityController::world_reported()
  void receive(const ReceivedUpdate& received, bool has_model) noexcept;
  /// Returns the wrench that may be displayed until the next tick.
  /// In      X_WH                 pose of the hand, without clutch; null: lost, or no usable scene
  ///         energy_from_local_j  StageOutput::energy_from_local_j
  Wrench apply(const Pose* X_WH, const Wrench& stage_on_hand_W, double energy_from_local_j, double period_s) noexcept;
  /// Sets the displayed wrench when later stages changed it.
  void set_displayed(const Wrench& on_hand_W) noexcept;
  /// The hand's pose has jumped or is lost.
  void lose_hand() noexcept { controller_.lose_hand(); }
  /// Prepares for another local model.
  void forget_local_model() noexcept { controller_.forget_local_model(); }
  /// Starts another scene.
  void reset() noexcept { controller_.reset(); }

  /// Share of the stage's wrench that passes: 1 while the controller is faded out.
  double gain() const noexcept { return 1 + share_ * (controller_.gain() - 1); }
  const haptics::HandPassivityController& controller() const noexcept { return controller_; }

 private:
  void fade(double period_s) noexcept;

  std::atomic<bool> is_on_;
  double share_;  ///< weight of the controller's wrench, 0 to 1
  bool keeps_account_;
  haptics::HandPassivityController controller_;
  LocalTime reported_at_{};  ///< reception time of the last energy report
};

}  // namespace tandem::client

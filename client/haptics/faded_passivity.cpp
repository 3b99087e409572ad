#include "client/haptics/faded_passivity.hpp"

#include <algorithm>

namespace tandem::client {
namespace {

/// Duration of fading the controller in or out.
constexpr double kFade_s = 0.3;

}  // namespace

FadedPassivity::FadedPassivity(bool is_on, bool keeps_account) noexcept
    : is_on_(is_on), share_(is_on ? 1 : 0), keeps_account_(is_on || keeps_account) {}

void FadedPassivity::receive(const ReceivedUpdate& received, bool has_model) noexcept {
  const proto::ServerUpdate& update = received.update;
  controller_.world_reported(update.energy_from_world_j, update.energy_into_world_j,
                             to_seconds(received.received - reported_at_), has_model);
  reported_at_ = received.received;
}

Wrench FadedPassivity::apply(const Pose* X_WH, const Wrench& stage_on_hand_W, double energy_from_local_j,
                             double period_s) noexcept {
  fade(period_s);
  if (!keeps_account_) return stage_on_hand_W;
  if (X_WH == nullptr) {
    controller_.lose_hand();
    return {};
  }
  controller_.local_model_reported(energy_from_local_j);
  const Wrench controlled = controller_.apply(*X_WH, stage_on_hand_W, period_s);
  if (share_ >= 1) return controlled;
  return stage_on_hand_W + (controlled - stage_on_hand_W) * share_;
}

void FadedPassivity::set_displayed(const Wrench& on_hand_W) noexcept {
  if (keeps_account_) controller_.set_displayed(on_hand_W);
}

void FadedPassivity::fade(double period_s) noexcept {
  const bool is_on = is_on_.load(std::memory_order_relaxed);
  keeps_account_ = keeps_account_ || is_on;
  share_ = std::clamp(share_ + (is_on ? 1 : -1) * period_s / kFade_s, 0.0, 1.0);
}

}  // namespace tandem::client

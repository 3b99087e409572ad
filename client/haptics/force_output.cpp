#include "client/haptics/force_output.hpp"

#include <algorithm>

namespace tandem::client {
namespace {

haptics::SafetySettings with_device_limits(haptics::SafetySettings settings, const devices::DeviceSpec& spec) {
  settings.slew_n_per_s = spec.slew_limit_n_per_s;
  settings.slew_n_m_per_s = spec.slew_limit_n_m_per_s;
  settings.speed_limit_m_per_s = spec.speed_limit_m_per_s;
  return settings;
}

}  // namespace

ForceOutput::ForceOutput(const haptics::SafetySettings& safety, devices::Device& device)
    : writer_(device), safety_(with_device_limits(safety, device.spec())) {}

void ForceOutput::write(LocalTime now, const Wrench& scene_on_hand_D, const Vec3& own_on_hand_D,
                        haptics::SafetyInput conditions, bool is_ready) noexcept {
  own_D_ = own_on_hand_D;
  requested_D_ = scene_on_hand_D + Wrench{own_D_, Vec3::Zero()};
  conditions.wrench = requested_D_;
  const Wrench safe = safety_.apply(now, conditions);
  display(now, is_ready ? safe : Wrench{});
}

bool ForceOutput::write_zero(LocalTime now) noexcept {
  return display(now, Wrench{}) && !writer_.may_be_on();
}

bool ForceOutput::display(LocalTime now, const Wrench& on_hand_D) noexcept {
  const bool is_accepted = writer_.write(now, on_hand_D);
  if (!is_accepted) {
    ++write_failures_;
    safety_.rearm();
  }
  safety_.set_displayed(writer_.written());
  work_.hold(writer_.written());
  return is_accepted;
}

// Returns the part of the displayed wrench that comes from the scene. It is the displayed wrench minus the client's own
// force (border and nudge). Safety chain and clamp scale the sum of both forces, so the own force is scaled by the same
// factor before the subtraction.
Wrench ForceOutput::displayed_of_scene_D() const noexcept {
  const double requested_n = requested_D_.f.norm();
  if (requested_n <= 0 || own_D_.isZero(0)) return writer_.written();
  const double share = std::min(1.0, writer_.written().f.norm() / requested_n);
  return writer_.written() - Wrench{share * own_D_, Vec3::Zero()};
}

}  // namespace tandem::client

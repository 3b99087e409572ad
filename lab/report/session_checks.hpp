// What a session of two hands on one body must show to be called good. The demo's exit code is the answer.
#pragma once

#include <span>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// What the checks hold against; chosen by us, with the reason beside each.
struct CheckBounds {
  double felt_force_n = 0.3;                  ///< several times the force that late-pose coupling shows a hand at rest
  double body_displacement_m = 0.002;         ///< more than a contact's penetration and settling
  double clamped_fraction = 0.01;             ///< a force that sits at the clamp is the device's, not the scene's
  double settled_hand_speed_m_per_s = 0.020;  ///< above tremor; a limit cycle moves the hand ten times as fast
  double ticks_run_fraction = 0.99;
  double tick_rate_hz = 1000;
  double tick_rate_error_fraction = 0.01;
};

/// All checks of every user of every session, in that order.
///
/// Fails   std::invalid_argument when a user has no phase "hold": there is nothing to check then
std::vector<Check> check_sessions(std::span<const Session> sessions, const CheckBounds& bounds = {});

}  // namespace tandem::lab

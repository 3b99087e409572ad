// How far the touch of a trial is from the truth: the same hands at zero delay on the server's own touch.
#pragma once

#include <vector>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// After a silence of so long the force has to fall.
inline constexpr double kLongSilence_ms = 110;

/// Phases of a hand's path in which it is in contact: those, except the ways there and back ("approach", "move",
/// "retreat"), in which the displayed force of the reference (without one: this run's) is kContactForce_n or more on
/// average.
inline constexpr double kContactForce_n = 0.1;
std::vector<bool> contact_phases(const UserView& view);

// Metrics of one user; the table in trial_metrics.cpp defines them. NaN without a reference, or where they have no
// meaning.
double free_drag_rms_n(const UserView& view);
double contact_force_mean_n(const UserView& view);
double contact_force_ratio(const UserView& view);
double contact_error_rms_n(const UserView& view);
double contact_error_fraction(const UserView& view);
double contact_delay_error_rms_n(const UserView& view);
double path_error_rms_n(const UserView& view);
double path_error_of_peak(const UserView& view);
double path_torque_error_rms_n_m(const UserView& view);
double path_torque_error_of_peak(const UserView& view);
double felt_stiffness_ratio(const UserView& view);
double hold_force_ratio(const UserView& view);
double hold_force_least_ratio(const UserView& view);
double force_step_max_n_per_ms(const UserView& view);
double return_step_max_n_per_ms(const UserView& view);
double torque_step_max_n_m_per_ms(const UserView& view);
double ghost_contact_ms(const UserView& view);
double force_above_60_hz_n(const UserView& view);

}  // namespace tandem::lab

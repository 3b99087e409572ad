// Errors of the displayed force in a trial, relative to the reference: a trial of the same hands at zero delay that
// displays the server's own contact forces.
#pragma once

#include <vector>

#include "lab/metrics/trial_metrics.hpp"

namespace tandem::lab {

/// Minimum duration of a long silence [ms]. A silence is an interval in which no state arrives, or in which the server
/// confirms no new input. In a long silence the displayed force must decay.
inline constexpr double kLongSilence_ms = 110;

/// Minimum mean force of a phase in contact [N].
inline constexpr double kContactForce_n = 0.1;
/// Returns, for each phase of a hand's path, whether the hand is in contact: the mean force in this phase is at least
/// kContactForce_n. The force is that of the reference or, without a reference, of the trial itself. The phases
/// "approach", "move" and "retreat" never count as contact.
std::vector<bool> contact_phases(const UserView& view);

// Metrics of one user, defined in the table in trial_metrics.cpp. A metric is NaN if it is undefined or there is no
// reference.
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

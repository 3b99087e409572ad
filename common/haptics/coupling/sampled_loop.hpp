// Exact discrete loop of one direction, from the hand to the contact of the tool, and its stability.
//
//   hand (m, b, k) ─ device (m, b) ─ encoder ─ velocity window ─ delay ─ coupling (k, b) ─ tool (m) ─ contact (k)
//                        ▲ force held for a period ◀──────────────────────┘
#pragma once

namespace tandem::haptics {

/// One translational direction; for a rotational one read inertia, N·m/rad and N·m·s/rad.
struct LoopModel {
  double period_s = 0.001;
  double stiffness = 300;        ///< stiffness of the coupling: the steepest slope of its law [N/m]
  double damping = 3;            ///< damping of the coupling [N·s/m]
  double tool_mass = 0.1;        ///< [kg]; 0: massless
  double device_mass = 0.1;      ///< [kg]
  double device_damping = 0.0;   ///< damping of the mechanism [N·s/m]
  double hand_mass = 0.3;        ///< [kg]; hand mass, stiffness and damping all 0: nobody holds the device
  double hand_stiffness = 200;   ///< [N/m]
  double hand_damping = 5.8;     ///< [N·s/m]
  double contact_stiffness = 0;  ///< stiffness of the tool's contact [N/m]; 0: no contact
  int velocity_window = 1;       ///< samples over which the handle's velocity is estimated
  int delay_periods = 0;         ///< delay from sample to force, beyond the one-period hold
};

/// Returns the largest magnitude of an eigenvalue of the loop's transition over one period; below 1 the loop is stable.
///
/// Model   hand and device together are one mass, integrated exactly under a held force (matrix exponential). Each
///         period: handle x_{k−d} with velocity (x_{k−d} − x_{k−d−n}) / (n T). The tool's end-of-step state follows
///         from coupling and contact by implicit Euler, as in the contact solver. The hand receives the opposite of the
///         tool's coupling force until the next period.
///         Neutral states are left out: the position of a device that nobody holds with a tool that touches nothing,
///         and, without friction, their common glide. Both have the eigenvalue 1 and do no harm.
/// Source  our derivation
/// Out     0 without stiffness and damping: no loop exists
/// Fails   infinity for a model that is not finite, has a negative entry or no mass, or uses samples older than 64
///         periods
/// Cost    cubic in window + delay; 5 µs at window 1 without delay, 1 ms at 20 (thread any but haptic: allocates)
double spectral_radius(const LoopModel& model);

}  // namespace tandem::haptics

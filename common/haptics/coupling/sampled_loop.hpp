// Exact discrete-time loop from the hand to the contact of the tool, in one direction of motion, and its stability.
//
//   hand (m, b, k) ─ device (m, b) ─ encoder ─ velocity window ─ delay ─ coupling (k, b) ─ tool (m) ─ contact (k)
//                        ▲ force held for a period ◀──────────────────────┘
#pragma once

namespace tandem::haptics {

/// Loop in one translational direction. For a rotational direction, read the units as kg·m², N·m/rad and N·m·s/rad.
struct LoopModel {
  double period_s = 0.001;
  double stiffness = 300;        ///< steepest slope of the coupling's law [N/m]
  double damping = 3;            ///< damping of the coupling [N·s/m]
  double tool_mass = 0.1;        ///< [kg]; 0: massless tool
  double device_mass = 0.1;      ///< [kg]
  double device_damping = 0.0;   ///< damping of the mechanism [N·s/m]
  double hand_mass = 0.3;        ///< [kg]; nobody holds the device if hand mass, stiffness and damping are all 0
  double hand_stiffness = 200;   ///< [N/m]
  double hand_damping = 5.8;     ///< [N·s/m]
  double contact_stiffness = 0;  ///< stiffness of the tool's contact [N/m]; 0: no contact
  int velocity_window = 1;       ///< number of periods over which the handle's velocity is estimated
  int delay_periods = 0;         ///< delay from sample to force in periods, in addition to the hold over one period
};

/// Returns the spectral radius: the largest magnitude of an eigenvalue of the loop's transition matrix over one period.
/// The loop is stable if the result is below 1.
///
/// Model   1. Hand and device are one mass, integrated exactly under a force held over the period T (matrix
///            exponential).
///         2. The handle seen by the coupling in period k is at x_{k−d}, with the velocity (x_{k−d} − x_{k−d−n}) / (n
///            T), for a delay of d periods and a velocity window of n periods.
///         3. The tool's state at the end of the period follows from coupling and contact by implicit Euler, as in the
///            contact solver.
///         4. The hand receives the negative of the tool's coupling force until the next period.
///         Two motions with the eigenvalue 1 are harmless and excluded: the position of a free device whose tool
///         touches nothing and, without friction, the common motion of device and tool at constant speed
/// Source  our derivation
/// Out     0 if stiffness and damping are both 0, because no loop exists
/// Fails   returns infinity for a model that is not finite, has a negative entry or no mass, or uses samples older than
///         64 periods
/// Cost    cubic in window + delay; 5 µs at window 1 without delay, 1 ms at window 20 (any thread but haptic:
///         allocates)
double spectral_radius(const LoopModel& model);

}  // namespace tandem::haptics

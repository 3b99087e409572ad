// Parameters of a user's hand, including the device that the hand holds.
#pragma once

namespace tandem::devices {

/// The hand and the held device, modelled as one mass–damper–spring system in each of six directions.
///
/// Model   m ẍ = K (x_intended − x) + B (ẋ_intended − ẋ) + f_device + tremor; the rotational equation has the same form
/// Source  0.3 kg and 200 N/m: a light grip, as used in the delay studies of this project.
///         Damping: the ratio 0.37 of the typical trial in "Haptic perception of force magnitude and its relation to
///         postural arm dynamics in 3D", Scientific Reports 5, 18004 (2015), fig. 3 (0.554 kg, 6.45 N·s/m, 135 N/m).
///         Rotation: our choice, for a handle of the size of a stylus: 7 Hz, damping ratio 0.56
struct HandParameters {
  double mass_kg = 0.3;
  double stiffness_n_per_m = 200.0;
  double damping_n_s_per_m = 5.8;
  double inertia_kg_m2 = 4e-4;
  double stiffness_n_m_per_rad = 0.8;
  double damping_n_m_s_per_rad = 0.02;
  double tremor_rms_n = 0.0;  ///< RMS value of the tremor force, in a narrow band around tremor_hz
  double tremor_hz = 9.0;
  /// Quantisation step of the reported position; 0: not quantised. If set, the reported velocity is estimated from the
  /// positions (VelocityEstimator), as for a device that reports only positions.
  double encoder_step_m = 0.0;
  double encoder_step_rad = 0.0;
};

}  // namespace tandem::devices

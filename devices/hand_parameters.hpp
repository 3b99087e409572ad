// Parameters of a user's hand and of the device that it holds.
#pragma once

namespace tandem::devices {

/// The hand and the device it holds, as one mass–damper–spring in each of six directions.
///
/// Model   m ẍ = K (x_intended − x) + B (ẋ_intended − ẋ) + f_device + tremor, likewise in rotation
/// Source  0.3 kg and 200 N/m: a light grip, the values behind the project's delay studies. The damping ratio, 0.37,
///         is that of the typical trial in "Haptic perception of force magnitude and its relation to postural arm
///         dynamics in 3D", Scientific Reports 5, 18004 (2015), fig. 3: 0.554 kg, 6.45 N·s/m, 135 N/m.
///         The rotational triple is ours: a stylus-sized handle, 7 Hz, damping ratio 0.56
struct HandParameters {
  double mass_kg = 0.3;
  double stiffness_n_per_m = 200.0;
  double damping_n_s_per_m = 5.8;
  double inertia_kg_m2 = 4e-4;
  double stiffness_n_m_per_rad = 0.8;
  double damping_n_m_s_per_rad = 0.02;
  double tremor_rms_n = 0.0;  ///< force, narrow band around tremor_hz
  double tremor_hz = 9.0;
  /// Quantisation of the reported position; 0: none. If set, the reported velocity is estimated from the positions
  /// (VelocityEstimator), as for a device that reports positions only.
  double encoder_step_m = 0.0;
  double encoder_step_rad = 0.0;
};

}  // namespace tandem::devices

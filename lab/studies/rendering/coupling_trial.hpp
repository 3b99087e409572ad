// What one stiffness and one damping do on one device: stable with a margin, calm, quiet, prompt. Translation and
// rotation are tried alike; "inertia" is a mass [kg] or a moment of inertia [kg·m²], forces are [N] or [N·m].
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "devices/device_profile.hpp"

namespace tandem::lab {

/// What is asked of a pair, of what hands, and how the pairs to try are chosen.
struct CalibrationSettings {
  double gain_margin = 2;        ///< stable with all forces this many times larger …
  int delay_margin_periods = 1;  ///< … and this much later
  double rate_hz = 1000;
  double tremor_rms_n = 0.05;  ///< of the hands that press; ours: plainly visible at a relaxed hand
  /// What a device that reports exact positions is taken to have: the step of the thesis's device, as of
  /// devices/README.
  double nominal_step_m = 3e-5;
  double nominal_step_rad = 1.4e-4;
  std::uint64_t seed = 1;
  /// Empty: eight from 0.02 kg to what the device can hold with 0.8 of its force limit, at most 2 kg.
  std::vector<double> masses_kg;
  /// "Quiet": roughness at most floor + share × the tool's weight. A light tool shows more of the encoder's grain than
  /// a heavy one, whose weight covers it: that is why the best stiffness grows with the mass. Both are ours; 2 mN is
  /// what the coarsest shipped encoder makes at 100 N/m.
  double roughness_floor_n = 0.002;
  double roughness_share_of_weight = 0.005;
  /// The stiffness may take this much of it: the rest is for the damping's choice.
  double stiffness_share_of_roughness = 0.75;
  double restlessness_steps = 2;  ///< "calm": a hand that rests is within so many encoder steps
  /// Of the tools whose inertias are tried, one for each mass: I = m r². For torque the limits are those of the force
  /// at this lever. A tool of 4 cm; ours.
  double gyration_radius_m = 0.02;
};

struct Pair {
  double stiffness = 0;
  double damping = 0;
};

/// One device, and whether it is pushed or turned.
class CouplingTrial {
 public:
  CouplingTrial(const devices::DeviceProfile& profile, bool is_rotation, const CalibrationSettings& settings)
      : profile_(profile), is_rotation_(is_rotation), settings_(settings) {}

  /// Largest spectral radius with the margins, over the hands of check_coupling(), tool in the air and in stiff
  /// contact.
  double spectral_radius(const Pair& pair, double inertia) const;

  // Hands press the tool on a plane (turn one that does not turn), relaxed, with a light and with a firm grip; the
  // worst of them counts. Cost of each: 3 simulated hands of 2 s, about 0.08 s.

  /// Range of the handle in the last quarter of 2 s without tremor, in encoder steps; 0 when it is still shrinking.
  double restlessness(const Pair& pair, double inertia) const;
  /// RMS above 30 Hz of the force, with tremor and a slow change of pressure.
  double roughness(const Pair& pair, double inertia) const;
  /// ∫ t |d − d_rest| dt after the tool has become heavy all at once, in a hand that nothing moves; d in m or rad,
  /// d_rest 1 mm. Least where the tool settles soonest with little overshoot: in continuous time at b = 1.4 √(k m).
  /// Source  Graham, Lathrop, "The synthesis of optimum transient response", AIEE Trans. 72, 1953: ITAE
  double settling_cost(const Pair& pair, double inertia) const;

 private:
  devices::HandParameters hand(double tremor_rms_n, std::size_t of_checked) const;
  double restlessness_of(std::size_t of_checked, const Pair& pair, double inertia) const;
  double roughness_of(std::size_t of_checked, const Pair& pair, double inertia) const;

  devices::DeviceProfile profile_;
  bool is_rotation_;
  CalibrationSettings settings_;
};

}  // namespace tandem::lab

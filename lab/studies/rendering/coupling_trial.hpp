// Trial of one stiffness and damping on one device: margin of stability, rest, noise and settling. Translation and
// rotation are handled alike; "inertia" is a mass [kg] or a moment of inertia [kg·m²], forces are [N] or [N·m].
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "devices/device_profile.hpp"

namespace tandem::lab {

/// Criteria for a pair, the simulated hands, and the choice of pairs to try.
struct CalibrationSettings {
  double gain_margin = 2;        ///< the loop must be stable with all forces this many times larger …
  int delay_margin_periods = 1;  ///< … and delayed by this many additional periods
  double rate_hz = 1000;
  double tremor_rms_n = 0.05;  ///< tremor of the pressing hands; our choice: plainly visible at a relaxed hand
  /// Encoder step assumed for a device with exact positions: that of the thesis's device, see devices/PROFILES.md.
  double nominal_step_m = 3e-5;
  double nominal_step_rad = 1.4e-4;
  std::uint64_t seed = 1;
  /// Empty: eight masses from 0.02 kg to the mass whose weight is 0.8 of the device's force limit, at most 2 kg.
  std::vector<double> masses_kg;
  /// Criterion "quiet": roughness is at most floor + share × the tool's weight. A light tool shows more encoder noise
  /// than a heavy one, whose weight masks it. So the best stiffness grows with the mass. Both values are ours; 2 mN is
  /// the noise of the coarsest shipped encoder at 100 N/m.
  double roughness_floor_n = 0.002;
  double roughness_share_of_weight = 0.005;
  /// Share of the allowed roughness that the choice of stiffness may use; the rest is reserved for the choice of
  /// damping.
  double stiffness_share_of_roughness = 0.75;
  double restlessness_steps = 2;  ///< criterion "calm": a resting hand stays within this range in encoder steps
  /// Gyration radius of the tried tools, one for each mass: I = m r². Torque limits are the force limits at this
  /// lever. A tool of 4 cm; our choice.
  double gyration_radius_m = 0.02;
};

struct Pair {
  double stiffness = 0;
  double damping = 0;
};

/// One device, and whether trials push or turn it.
class CouplingTrial {
 public:
  CouplingTrial(const devices::DeviceProfile& profile, bool is_rotation, const CalibrationSettings& settings)
      : profile_(profile), is_rotation_(is_rotation), settings_(settings) {}

  /// Largest spectral radius with the margins, over the hands of check_coupling(), with the tool in the air and in
  /// stiff contact.
  double spectral_radius(const Pair& pair, double inertia) const;

  // Hands press the tool on a plane, or turn against a tool that does not turn: relaxed, with a light grip and with a
  // firm grip. The worst counts. Cost of each: 3 simulated hands of 2 s, about 0.08 s.

  /// Range of the handle in the last quarter of 2 s without tremor, in encoder steps; 0 when it is still shrinking.
  double restlessness(const Pair& pair, double inertia) const;
  /// RMS of the force above 30 Hz, with tremor and a slow change of pressure.
  double roughness(const Pair& pair, double inertia) const;
  /// ∫ t |d − d_rest| dt after the tool's weight is applied as a step, with a hand that does not move; d in m or rad,
  /// d_rest 1 mm. Smallest where the tool settles fastest with little overshoot: in continuous time at b = 1.4 √(k m).
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

// What one stiffness and one damping do on one device: stable with a margin, calm, quiet, prompt. Translation and
// rotation are tried alike; "inertia" is a mass [kg] or a moment of inertia [kg·m²], forces are [N] or [N·m].
#pragma once

#include <cstdint>

#include "devices/device_profile.hpp"

namespace tandem::lab {

/// What is asked of a pair, and of what hand.
struct TrialSettings {
  double gain_margin = 2;        ///< stable with all forces this many times larger …
  int delay_margin_periods = 1;  ///< … and this much later
  double rate_hz = 1000;
  double tremor_rms_n = 0.05;  ///< of the hands that press; ours: plainly visible at a relaxed hand
  /// What a device that reports exact positions is taken to have: the step of the thesis's device, as of
  /// devices/README.
  double nominal_step_m = 3e-5;
  double nominal_step_rad = 1.4e-4;
  std::uint64_t seed = 1;
};

struct Pair {
  double stiffness = 0;
  double damping = 0;
};

/// One device, and whether it is pushed or turned.
class CouplingTrial {
 public:
  CouplingTrial(const devices::DeviceProfile& profile, bool is_rotation, const TrialSettings& settings)
      : profile_(profile), is_rotation_(is_rotation), settings_(settings) {}

  /// Largest spectral radius with the margins, over the hands of check_coupling(), tool in the air and in stiff
  /// contact.
  double spectral_radius(const Pair& pair, double inertia) const;

  /// What hands that press feel; the worst of the hands.
  struct Press {
    /// Range of the handle in the last quarter of 2 s without tremor, in encoder steps; 0 when it is still shrinking.
    double restlessness = 0;
    double roughness = 0;  ///< RMS above 30 Hz of the force, with tremor and a slow change of pressure
  };
  /// Presses the tool on a plane (turns one that does not turn), relaxed, with a light and with a firm grip.
  /// Cost   6 simulated hands of 2 s: about 0.15 s
  Press press(const Pair& pair, double inertia) const;

  /// ∫ t |d − d_rest| dt after the tool has become heavy all at once, in a hand that nothing moves; d in m or rad,
  /// d_rest 1 mm. Least where the tool settles soonest with little overshoot: in continuous time at b = 1.4 √(k m).
  /// Source  Graham, Lathrop, "The synthesis of optimum transient response", AIEE Trans. 72, 1953: ITAE
  double settling_cost(const Pair& pair, double inertia) const;

 private:
  devices::HandParameters hand(double tremor_rms_n, std::size_t of_checked) const;
  double restlessness(const Pair& pair, double inertia, std::size_t of_checked) const;
  double roughness(const Pair& pair, double inertia, std::size_t of_checked) const;

  devices::DeviceProfile profile_;
  bool is_rotation_;
  TrialSettings settings_;
};

}  // namespace tandem::lab

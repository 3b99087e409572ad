// Tests one pair of stiffness and damping on one device: stability margin, rest, noise and settling. Translation and
// rotation are treated alike: "inertia" is a mass [kg] or a moment of inertia [kg·m²], and forces are in N or N·m.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "devices/device_profile.hpp"

namespace tandem::lab {

/// Criteria for a pair, parameters of the simulated hands, and the choice of the masses.
struct CalibrationSettings {
  double gain_margin = 2;        ///< criterion "stability": factor on all forces at which the loop is still stable
  int delay_margin_periods = 1;  ///< criterion "stability": additional delay of the forces in the same test [periods]
  double rate_hz = 1000;
  double tremor_rms_n = 0.05;  ///< tremor of the pressing hands; our choice: clearly visible in a relaxed hand
  /// Encoder step assumed for a device that reports exact positions: the step of the device in the source thesis; see
  /// devices/PROFILES.md.
  double nominal_step_m = 3e-5;
  double nominal_step_rad = 1.4e-4;
  std::uint64_t seed = 1;
  /// Masses to calibrate. If empty: eight masses from 0.02 kg up to the mass whose weight is 0.8 of the device's force
  /// limit, but at most 2 kg.
  std::vector<double> masses_kg;
  /// Criterion "quiet": the roughness is at most floor + share × weight of the tool. The weight of a heavy tool masks
  /// encoder noise, so more noise is permitted there. Therefore the best stiffness increases with the mass. Both values
  /// are our choice; 2 mN is the noise of the coarsest shipped encoder at 100 N/m.
  double roughness_floor_n = 0.002;
  double roughness_share_of_weight = 0.005;
  /// Fraction of the permitted roughness that the choice of stiffness may use. The rest is reserved for the choice of
  /// damping.
  double stiffness_share_of_roughness = 0.75;
  /// Criterion "rest": largest permitted range of the handle's position while the hand rests [encoder steps].
  double restlessness_steps = 2;
  /// Radius of gyration r of the tools. It gives the moment of inertia for each mass, I = m r², and the torque limit,
  /// which is the force limit times r. It corresponds to a tool of 4 cm; our choice.
  double gyration_radius_m = 0.02;
};

struct Pair {
  double stiffness = 0;
  double damping = 0;
};

/// Runs trials on one device, either in translation or in rotation.
class CouplingTrial {
 public:
  CouplingTrial(const devices::DeviceProfile& profile, bool is_rotation, const CalibrationSettings& settings)
      : profile_(profile), is_rotation_(is_rotation), settings_(settings) {}

  /// Returns the largest spectral radius of the loop, with gain and delay margin. The maximum is taken over the hands
  /// of check_coupling(), for a tool in the air and for a tool in stiff contact.
  double spectral_radius(const Pair& pair, double inertia) const;

  // In the two following trials, hands press the tool on a plane, or twist against a tool that cannot rotate. The hands
  // are relaxed, with a light grip and with a firm grip; the worst result is returned. Each trial simulates 3 hands for
  // 2 s, which takes about 0.08 s.

  /// Returns the range of the handle in the last quarter of 2 s without tremor [encoder steps]. It is 0 if the range is
  /// still shrinking.
  double restlessness(const Pair& pair, double inertia) const;
  /// Returns the RMS of the force above 30 Hz [N or N·m], with tremor and a slow change of the pressing force.
  double roughness(const Pair& pair, double inertia) const;
  /// Returns ∫ t |d − d_rest| dt after the weight of the tool is applied as a step while the hand does not move. d is
  /// the sag in m or rad; d_rest is 1 mm. The integral is smallest for fast settling with little overshoot. In
  /// continuous time, its minimum is at b = 1.4 √(k m).
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

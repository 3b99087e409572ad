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
  /// criterion "stability": the loop must be stable even if all forces are multiplied by this factor
  double gain_margin = 2;
  /// criterion "stability": additional delay of the forces at which the loop must be stable, together with gain_margin
  /// [periods]
  int delay_margin_periods = 1;
  double rate_hz = 1000;
  double tremor_rms_n = 0.05;  ///< tremor of the pressing hands; our choice: clearly visible in a relaxed hand
  /// Encoder steps that are assumed for a device that reports exact positions. They are those of the device in Hou
  /// 2014; see devices/PROFILES.md.
  double nominal_step_m = 3e-5;
  double nominal_step_rad = 1.4e-4;
  std::uint64_t seed = 1;
  /// Masses to calibrate. If empty: eight masses from 0.02 kg up to the mass whose weight is 0.8 of the device's force
  /// limit, but at most 2 kg.
  std::vector<double> masses_kg;
  /// Criterion "quiet": the roughness (see roughness()) is at most roughness_floor_n + roughness_share_of_weight ×
  /// weight of the tool. More noise is permitted for a heavy tool, because its weight masks the noise. Therefore the
  /// best stiffness increases with the mass. Both values are our choice. 2 mN is the noise of the coarsest encoder of a
  /// shipped profile at 100 N/m.
  double roughness_floor_n = 0.002;
  double roughness_share_of_weight = 0.005;
  /// Fraction of the permitted roughness that the choice of stiffness may use. The rest is reserved for the choice of
  /// damping.
  double stiffness_share_of_roughness = 0.75;
  /// Criterion "rest": largest permitted range of the handle's position while the hand rests [encoder steps].
  double restlessness_steps = 2;
  /// Radius of gyration r of the tools; our choice for a tool of 4 cm. It determines the moment of inertia of a tool of
  /// mass m, I = m r², and the torque limit, r times the force limit.
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

  /// Returns the range of the handle's position in the last 0.25 s of a press of 2 s without tremor [encoder steps]. It
  /// is 0 if the motion is still decaying.
  double restlessness(const Pair& pair, double inertia) const;
  /// Returns the RMS of the force above 30 Hz [N or N·m], with tremor and a slow change of the pressing force.
  double roughness(const Pair& pair, double inertia) const;
  /// Returns a cost that is smallest for fast settling with little overshoot: ∫ t |d − d_rest| dt (ITAE). The weight of
  /// the tool is applied as a step at t = 0 while the hand does not move.
  /// * d: sag of the tool below the hand [m or rad]
  /// * d_rest: final sag, 1 mm
  ///
  /// In continuous time, the best damping is b = 1.4 √(k m).
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

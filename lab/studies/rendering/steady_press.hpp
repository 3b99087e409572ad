// A hand that presses a light tool on a plane with a wanted force, and what it feels meanwhile.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/studies/conventions.hpp"
#include "lab/studies/rendering/hand_rig.hpp"

namespace tandem::lab {

/// What is the same for every law: those of the thesis where it says (tool, limit, damping, encoder), else ours.
struct PressSettings {
  /// For every law as it is, not made equal: then limit, secant stiffness and damping below do not count.
  std::optional<haptics::CouplingParameters> coupling;
  double force_limit_n = 4;
  double secant_n_per_m = 300;     ///< of every law at 1 N
  double damping_n_s_per_m = 0.2;  ///< of every law with a damper
  double tool_mass_kg = 0.02;
  double encoder_step_m = 3e-5;  ///< 0.03 mm
  double tremor_rms_n = 0.05;
  double settling_s = 2.5;
  double recorded_s = 8;
  std::uint64_t seed = 1;
};

struct SteadyPress {
  double mean_normal_n = 0;
  double rms_n = 0;              ///< of the force on the hand above kVibration_hz
  double range_n = 0;            ///< highest less lowest
  std::vector<double> normal_n;  ///< on the hand, one a tick
};

/// The rig of a law with this secant stiffness at 1 N, or with the coupling that is given. For direct rendering the
/// plane is as soft as that.
HandRigSettings equal_rig(std::string_view law, const PressSettings& settings);

/// What one step of the encoder does to the force: by the slope at this force, and by the damper in the worst case,
/// when the velocity's window is one period.
double encoder_quantum_n(std::string_view law, double force_n, const PressSettings& settings);

/// In      force_n  at which hand, coupling and plane would balance without tremor
SteadyPress press_steadily(std::string_view law, double force_n, const PressSettings& settings);

}  // namespace tandem::lab

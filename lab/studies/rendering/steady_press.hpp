// A hand presses a light tool on a plane with a given force while the force on the hand is recorded.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lab/studies/conventions.hpp"
#include "lab/studies/rendering/hand_rig.hpp"

namespace tandem::lab {

/// Settings that all laws share. Tool, force limit, damping and encoder step are taken from the thesis Hou 2014
/// (reproduce_laws.hpp). The other values are our choice.
struct PressSettings {
  /// If set, every law uses this coupling, and the settings for limit, secant stiffness and damping are ignored.
  std::optional<haptics::CouplingParameters> coupling;
  double force_limit_n = 4;
  double secant_n_per_m = 300;     ///< secant stiffness of every law at a force of 1 N
  double damping_n_s_per_m = 0.2;  ///< damping of every law with a damper
  double tool_mass_kg = 0.02;
  double encoder_step_m = 3e-5;  ///< encoder step of the device in Hou 2014
  double tremor_rms_n = 0.05;
  double settling_s = 2.5;
  double recorded_s = 8;
  std::uint64_t seed = 1;
};

struct SteadyPress {
  double mean_normal_n = 0;
  double rms_n = 0;              ///< RMS of the force on the hand above kVibration_hz
  double range_n = 0;            ///< maximum minus minimum of the force
  std::vector<double> normal_n;  ///< normal force on the hand, one value for each tick
};

/// Returns the hand rig for a coupling law. Without a coupling in the settings, the law's parameters are chosen such
/// that its secant stiffness at 1 N is that of the settings. Direct rendering, which has no tool, uses a plane of this
/// stiffness.
HandRigSettings equal_rig(std::string_view law, const PressSettings& settings);

/// Returns the largest change of the force that one encoder step causes. It is the sum of two changes: that of the
/// law's elastic force, by its slope at `force_n`, and that of the damper. For the damper, the velocity is assumed to
/// be estimated over a single period, which is the worst case.
double encoder_quantum_n(std::string_view law, double force_n, const PressSettings& settings);

/// Runs the press.
/// In      force_n  mean force of the press: the force at which hand, coupling and plane are in equilibrium without
///         tremor
SteadyPress press_steadily(std::string_view law, double force_n, const PressSettings& settings);

}  // namespace tandem::lab

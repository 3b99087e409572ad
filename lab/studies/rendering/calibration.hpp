// Calibrates the adaptive law: a search finds the best coupling for each tool mass on a given device. The criteria
// "stability", "rest" and "quiet" are defined in CalibrationSettings.
//
//   1. For each mass, the best stiffness is the largest one that fulfils all three criteria.
//   2. A polynomial k(m) is fitted to the best stiffness k as a function of the mass m (Hou 2014, eqs. 5.2, 5.13,
//      5.14).
//   3. For each best stiffness, the best damping is the one with which the tool settles fastest, provided that all
//      criteria are fulfilled.
//   4. A polynomial b(k) is fitted to the best damping b as a function of the stiffness k (eqs. 5.3, 5.15).
//   5. If the device displays torque, steps 1 to 4 are repeated for moments of inertia (eq. 5.7).
#pragma once

#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/studies/rendering/coupling_trial.hpp"

namespace tandem::lab {

/// Result for one mass [kg] or moment of inertia [kg·m²].
struct CalibrationPoint {
  double inertia = 0;
  double mass_kg = 0;  ///< mass of the tool with this inertia
  Pair best;
  double first_damping = 0;  ///< damping with which the stiffness was searched; replaced by the best damping later
  /// Reason why the stiffness is not larger: a violated criterion ("stability", "rest" or "quiet"), the verified
  /// maximum of the device ("maximum"), or an assumed maximum if the device has no verified one ("cap").
  std::string_view limited_by;
  double spectral_radius = 0;  ///< spectral radius for `best`, including the margins
  double restlessness = 0;     ///< restlessness for `best`, in encoder steps
  double roughness = 0;        ///< roughness for `best`
  double roughness_allowed = 0;
  Pair fitted;                        ///< pair given by the fitted polynomials
  double fitted_spectral_radius = 0;  ///< spectral radius for `fitted`, including the margins
  double fitted_restlessness = 0;
  double fitted_roughness = 0;
};

/// Calibration of translation or of rotation.
struct AxisCalibration {
  /// Points sorted by inertia. The last one is the first point that reaches the maximum stiffness.
  std::vector<CalibrationPoint> points;
  /// Masses that are too light: even the softest tried pair (`best`) violates the criterion `limited_by`. The fits
  /// exclude these masses.
  std::vector<CalibrationPoint> left_out;
  haptics::Cubic stiffness;  ///< polynomial of the stiffness as a function of the inertia
  haptics::Cubic damping;    ///< polynomial of the damping as a function of the stiffness
  int stiffness_degree = 0;
  int damping_degree = 0;
  double stiffness_maximum = 0;  ///< upper limit from coupling_bounds()
  /// false if the maximum is only an assumed cap, so that the device may permit more
  bool is_maximum_verified = true;
  double damping_maximum = 0;
};

struct Calibration {
  devices::DeviceProfile profile;  ///< profile of the device, with the result of the calibration
  CalibrationSettings settings;
  AxisCalibration translation;
  std::optional<AxisCalibration> rotation;
};

/// Finds stiffness k and damping b for each mass m, and fits polynomials to them.
///
/// Model   k(m) and b(k) are the fitted polynomials. At each calibrated mass, k(m) is at most the best stiffness that
///         the search found. At every mass between them, k(m) is at most the stiffness that coupling_bounds() permits
/// Source  Hou, PhD thesis, NTU, 2014, chapter 5: the procedure. The thesis leaves the criterion for "best" to the
///         experimenter; ours is defined in CalibrationSettings
/// In      on_progress  called with the finished fraction, 0..1
/// Fails   std::invalid_argument: the masses are not increasing or not within 0.001..100 kg, or the smallest tried
///         stiffness is too large for every mass on this device
/// Cost    up to 15 s on one core for a shipped profile. The same settings give the same bits
Calibration calibrate(const devices::DeviceProfile& profile, const CalibrationSettings& settings,
                      const std::function<void(double)>& on_progress);

/// Returns checks of the polynomials: the fitted pairs fulfil the criteria "stability", "rest" and "quiet", and their
/// stiffness and damping are close to those of the best pairs.
std::vector<Check> checks_of(const Calibration& calibration);

}  // namespace tandem::lab

// Calibration of the adaptive law: the best coupling for each tool mass on a given device, found by search.
//
//   for each mass    the best stiffness: the largest that keeps the margins of stability and stays calm and quiet
//   over the masses  a polynomial k(m)                                         (Hou 2014, eqs. 5.2, 5.13, 5.14)
//   for each best k  the best damping: the tool settles soonest, same margins
//   over stiffness   a polynomial b(k)                                         (eqs. 5.3, 5.15)
//   again for inertias, where the device shows torque                          (eq. 5.7)
#pragma once

#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "lab/report/check.hpp"
#include "lab/studies/rendering/coupling_trial.hpp"

namespace tandem::lab {

/// One mass [kg] or moment of inertia [kg·m²].
struct CalibrationPoint {
  double inertia = 0;
  double mass_kg = 0;  ///< mass of the tool with this inertia
  Pair best;
  double first_damping = 0;  ///< damping with which the stiffness was found
  /// Reason why the stiffness is not higher: "maximum" of the device, "cap" where that is unverified, "stability",
  /// "rest" or "quiet".
  std::string_view limited_by;
  double spectral_radius = 0;  ///< that of `best`, including the margins
  double restlessness = 0;     ///< that of `best`, in encoder steps
  double roughness = 0;        ///< that of `best`
  double roughness_allowed = 0;
  Pair fitted;                        ///< pair given by the polynomials
  double fitted_spectral_radius = 0;  ///< that of `fitted`, including the margins
  double fitted_restlessness = 0;
  double fitted_roughness = 0;
};

/// Calibration of translation or of rotation.
struct AxisCalibration {
  std::vector<CalibrationPoint> points;  ///< sorted by inertia, up to the first at the stiffness maximum
  /// Masses that are too light: even the softest tried pair (`best`) violates the rule `limited_by`. The fits exclude
  /// them.
  std::vector<CalibrationPoint> left_out;
  haptics::Cubic stiffness;  ///< function of the inertia
  haptics::Cubic damping;    ///< function of the stiffness
  int stiffness_degree = 0;
  int damping_degree = 0;
  double stiffness_maximum = 0;     ///< limit from coupling_bounds()
  bool is_maximum_verified = true;  ///< false: the maximum is a cap, and the device itself may allow more
  double damping_maximum = 0;
};

struct Calibration {
  devices::DeviceProfile profile;  ///< profile that contains the result
  CalibrationSettings settings;
  AxisCalibration translation;
  std::optional<AxisCalibration> rotation;
};

/// Model   k(m), b(k) as above; no polynomial gives a tried mass more stiffness than was found for it, or any mass in
///         the range more than coupling_bounds() allows
/// Source  Hou, PhD thesis, NTU, 2014, chapter 5: the procedure. He leaves the criterion of "best" to the
///         experimenter; ours is stated in CalibrationSettings
/// In      on_progress  0..1
/// Fails   std::invalid_argument: masses that are not increasing or not in 0.001..100 kg; a device for which the
///         smallest tried stiffness is too much for every mass
/// Cost    up to 15 s on one core for a shipped profile; the same settings give the same bits
Calibration calibrate(const devices::DeviceProfile& profile, const CalibrationSettings& settings,
                      const std::function<void(double)>& on_progress);

/// Checks that the fitted pairs satisfy the criteria of the best ones and lose little of their stiffness and damping.
std::vector<Check> checks_of(const Calibration& calibration);

}  // namespace tandem::lab

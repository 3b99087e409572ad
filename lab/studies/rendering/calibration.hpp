// Which coupling suits a tool of a given mass on a given device: the adaptive law's table, found by trying.
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
  double mass_kg = 0;  ///< of the tool that has it
  Pair best;
  double first_damping = 0;  ///< with which the stiffness was found
  /// Why not stiffer: "maximum" of the device, "cap" where nobody has verified that, "stability", "rest" or "quiet".
  std::string_view limited_by;
  double spectral_radius = 0;  ///< of `best`, with the margins
  double restlessness = 0;     ///< likewise, in encoder steps
  double roughness = 0;        ///< likewise
  double roughness_allowed = 0;
  Pair fitted;                        ///< what the polynomials give
  double fitted_spectral_radius = 0;  ///< with the margins
  double fitted_restlessness = 0;
  double fitted_roughness = 0;
};

/// Of translation or rotation.
struct AxisCalibration {
  std::vector<CalibrationPoint> points;  ///< by inertia, up to the first that gets the most that the device may show
  /// Too light: for these even the softest that is tried (`best`) breaks the rule `limited_by`. No fit is of them.
  std::vector<CalibrationPoint> left_out;
  haptics::Cubic stiffness;  ///< of the inertia
  haptics::Cubic damping;    ///< of the stiffness
  int stiffness_degree = 0;
  int damping_degree = 0;
  double stiffness_maximum = 0;     ///< of coupling_bounds()
  bool is_maximum_verified = true;  ///< else it is a cap, and the device itself may be stiffer
  double damping_maximum = 0;
};

struct Calibration {
  devices::DeviceProfile profile;  ///< with the result in it
  CalibrationSettings settings;
  AxisCalibration translation;
  std::optional<AxisCalibration> rotation;
};

/// Model   k(m), b(k) as above; no polynomial gives a tried mass more stiffness than was found for it, nor any mass in
///         the range more than coupling_bounds() allows
/// Source  Hou, PhD thesis, NTU, 2014, chapter 5: the procedure. What is "best" he leaves to the experimenter; ours is
///         stated in CalibrationSettings
/// In      on_progress  0..1
/// Fails   std::invalid_argument: masses that are not increasing or not in 0.001..100 kg; a device for which the
///         smallest tried stiffness is too much for every mass
/// Cost    of a shipped profile up to 15 s on one core; the same bits for the same settings
Calibration calibrate(const devices::DeviceProfile& profile, const CalibrationSettings& settings,
                      const std::function<void(double)>& on_progress);

/// That the fitted pairs keep what the best ones were chosen by, and give away little of what was found.
std::vector<Check> checks_of(const Calibration& calibration);

}  // namespace tandem::lab

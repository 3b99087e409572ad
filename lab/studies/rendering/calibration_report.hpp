// Reports of a calibration as JSON, as HTML and as text for a terminal.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/report/html_report.hpp"
#include "lab/studies/rendering/calibration.hpp"

namespace tandem::lab {

/// Returns {"device", "settings", "translation", "rotation", "checks"}. "rotation" is null if it was not calibrated.
/// "translation" and "rotation" contain:
/// * "points": for each mass, the best pair of stiffness and damping, the criterion that limits the stiffness, the
///   measured values, and the fitted pair;
/// * "left_out": masses that are too light;
/// * "stiffness", "damping": coefficients and degree of the fitted polynomials;
/// * upper limits of stiffness and damping.
boost::json::object to_json(const Calibration& calibration);
HtmlReport to_report(const Calibration& calibration);
std::string to_text(const Calibration& calibration);

}  // namespace tandem::lab

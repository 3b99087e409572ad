// Reports of a calibration as JSON, as HTML and as text for a terminal.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/report/html_report.hpp"
#include "lab/studies/rendering/calibration.hpp"

namespace tandem::lab {

/// Returns {"device", "settings", "translation", "rotation" (null if not calibrated), "checks"}. "translation" and
/// "rotation" contain "points" (for each mass: the best pair, the criterion that limits its stiffness, the measured
/// values, the fitted pair), "left_out" (masses that are too light), "stiffness" and "damping" (coefficients, degree),
/// and the upper limits.
boost::json::object to_json(const Calibration& calibration);
HtmlReport to_report(const Calibration& calibration);
std::string to_text(const Calibration& calibration);

}  // namespace tandem::lab

// What a calibration found: for programs, for people with a browser, for the terminal.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/studies/rendering/calibration.hpp"

namespace tandem::lab {

/// {"device", "settings", "translation", "rotation" (null without), "checks"}; an axis has "points" (one for each mass:
/// the best pair, why not stiffer, what was measured, the fitted pair), "left_out" (masses that are too light),
/// "stiffness", "damping" (coefficients, degree), and the most that was allowed.
boost::json::object to_json(const Calibration& calibration);
std::string to_html(const Calibration& calibration);
std::string to_text(const Calibration& calibration);

}  // namespace tandem::lab

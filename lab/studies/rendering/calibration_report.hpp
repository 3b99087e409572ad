// Reports of a calibration as JSON, HTML and terminal text.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/studies/rendering/calibration.hpp"

namespace tandem::lab {

/// {"device", "settings", "translation", "rotation" (null without), "checks"}; an axis has "points" (one for each
/// mass: the best pair, the reason for not being stiffer, the measured values, the fitted pair), "left_out" (masses
/// that are too light), "stiffness", "damping" (coefficients, degree), and the upper limits.
boost::json::object to_json(const Calibration& calibration);
std::string to_html(const Calibration& calibration);
std::string to_text(const Calibration& calibration);

}  // namespace tandem::lab

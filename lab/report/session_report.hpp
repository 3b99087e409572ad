// HTML page with the measurements of all users in one or several sessions and the checks of these measurements.
#pragma once

#include <span>
#include <string>

#include "lab/report/html_report.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// Returns the page: the verdict and the forces, then the figures and tables of each session.
HtmlReport session_report(std::span<const Session> sessions, std::span<const Check> checks);

}  // namespace tandem::lab

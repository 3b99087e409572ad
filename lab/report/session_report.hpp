// HTML page with the measurements of all users in one or several sessions and the checks of these measurements.
#pragma once

#include <span>
#include <string>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// Returns an HTML file. It contains the verdict, then the users, figures and tables of each session.
std::string session_report_html(std::span<const Session> sessions, std::span<const Check> checks);

}  // namespace tandem::lab

// The page that shows what the users of one or several sessions felt, held against the checks.
#pragma once

#include <span>
#include <string>

#include "lab/report/check.hpp"
#include "lab/report/session_data.hpp"

namespace tandem::lab {

/// An HTML file: verdict, then of each session its users, figures and tables.
std::string session_report_html(std::span<const Session> sessions, std::span<const Check> checks);

}  // namespace tandem::lab

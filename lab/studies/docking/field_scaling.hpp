// `tandem-lab bench docking --sweep`: cost of the molecular field as a function of the size of the interface.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/report/html_report.hpp"

namespace tandem::lab {

/// Returns the report of the sweep.
/// In      rows  rows as printed by bench docking, by ascending interface_atoms
HtmlReport field_scaling_report(const std::string& subtitle, const boost::json::array& rows);

}  // namespace tandem::lab

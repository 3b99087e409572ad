// `tandem-lab bench docking --sweep`: what the molecular field costs against the size of the interface.
#pragma once

#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

/// In      rows  as bench docking prints them, by ascending interface_atoms
std::string field_scaling_html(const std::string& subtitle, const boost::json::array& rows);

}  // namespace tandem::lab

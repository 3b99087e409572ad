// Measures of a session as JSON, for the data folder.
#pragma once

#include <string>

#include "common/base/json.hpp"
#include "lab/therapy/session_measures.hpp"

namespace tandem::lab {

/// Returns the JSON of a session. Unknown numbers (NaN) are omitted.
boost::json::object to_json(const SessionMeasures& session);

/// Parses the JSON of a session.
/// In      origin  file name for error messages
/// Fails   std::invalid_argument, which names file, field, value and remedy
SessionMeasures session_from_json(const boost::json::value& value, const std::string& origin);

}  // namespace tandem::lab

// Writes JSON text for human readers: indented, with the shortest decimal numbers that parse to the same value.
#pragma once

#include <string>

#include "common/base/json.hpp"

namespace tandem {

/// Returns the JSON text of `value`, indented by two spaces per level, with a line feed at the end. Numbers that JSON
/// cannot represent (NaN, infinity) become null. Equal values give equal bytes on every machine.
std::string pretty_json(const boost::json::value& value);
/// Returns the JSON text of `value` on one line, for messages.
std::string compact_json(const boost::json::value& value);

}  // namespace tandem

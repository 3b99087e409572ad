// JSON text that people can read: indented, with the shortest numbers that parse to the same value.
#pragma once

#include <string>

#include "common/base/json.hpp"

namespace tandem {

/// Text of `value` with two spaces an indent and a line feed at the end. Numbers that JSON does not have (NaN,
/// infinity) become null. The same value gives the same bytes on every machine.
std::string pretty_json(const boost::json::value& value);
/// The same numbers on one line, for messages.
std::string compact_json(const boost::json::value& value);

}  // namespace tandem

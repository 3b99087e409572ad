// User names, which appear in logs, terminals and windows of other people.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem::server {

/// True for 1 to 64 bytes of valid UTF-8 without control, line-breaking, direction-overriding or invisible characters,
/// and without a space at either end or two in a row.
bool is_acceptable_user_name(std::string_view name);
/// Returns `name`, with a number appended if it is taken: "ada (2)".
std::string name_beside(const std::string& name, const std::vector<std::string>& taken);

/// Makes client text safe for a log or an error text.
std::string quoted(const std::string& text);

}  // namespace tandem::server

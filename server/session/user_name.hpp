// Rules for user names, which are displayed in logs, terminals and the windows of other users.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem::server {

/// Returns true for 1 to 64 bytes of valid UTF-8 without control, line-breaking, direction-overriding or invisible
/// characters. A name must not begin or end with a space, or contain two spaces in a row.
bool is_acceptable_user_name(std::string_view name);
/// Returns `name`, with a number appended if it is taken: "ada (2)".
std::string name_beside(const std::string& name, const std::vector<std::string>& taken);

/// Returns text from a client in a form that is safe in logs and error messages: in quotes, or "(unprintable)".
std::string quoted(const std::string& text);

}  // namespace tandem::server

// Names that people give themselves end up in logs, terminals and windows of other people.
#pragma once

#include <string_view>

namespace tandem::server {

/// True for 1 to 64 bytes of valid UTF-8 without control, line-breaking or direction-overriding characters.
bool is_acceptable_user_name(std::string_view name);

}  // namespace tandem::server

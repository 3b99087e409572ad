// Validates text received over the network (UTF-8) and makes it safe to display on terminals.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::net {

/// Removes one code point from the front of a non-empty text and returns it. For invalid UTF-8 (overlong form,
/// surrogate, …) it returns nothing and removes nothing.
std::optional<std::uint32_t> pop_code_point(std::string_view& text);

/// Returns false for a control character, a line break or a change of text direction, true for all others.
bool is_harmless(std::uint32_t code);

/// Returns the text as one line of at most `most_bytes` bytes; "?" replaces each harmful character and each invalid
/// byte.
std::string printable(std::string_view text, std::size_t most_bytes = 400);

}  // namespace tandem::net

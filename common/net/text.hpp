// Text received over the network: validates UTF-8 and makes it safe for terminals and readers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::net {

/// Removes one code point from the front of a non-empty text. Returns nothing and removes nothing for overlong forms,
/// surrogates and any other invalid UTF-8.
std::optional<std::uint32_t> pop_code_point(std::string_view& text);

/// Returns whether the code is no control character, no line break and no change of text direction.
bool is_harmless(std::uint32_t code);

/// Text in one line, at most `most_bytes`; "?" replaces each harmful character and each invalid byte.
std::string printable(std::string_view text, std::size_t most_bytes = 400);

}  // namespace tandem::net

// Text that came over the network: UTF-8 that a terminal and a reader can bear.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tandem::net {

/// Takes one code point off the front of a text that is not empty; nothing, and takes nothing, for overlong forms,
/// surrogates and all else that is not UTF-8.
std::optional<std::uint32_t> take_code_point(std::string_view& text);

/// Neither commands a terminal, nor breaks the line, nor turns the direction in which what follows is read.
bool is_harmless(std::uint32_t code);

/// In one line, at most `most_bytes`; "?" for each character that is not harmless, and each byte that is none.
std::string printable(std::string_view text, std::size_t most_bytes = 400);

}  // namespace tandem::net

// Splits text formats of meshes into words and lines. Nothing is copied; a number must be valid as a whole.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tandem::server::mesh_reader {

inline std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Removes the first word of `text` and returns it; empty at the end.
std::string_view next_word(std::string_view& text);

/// Removes the first line of `text` and returns it without its end ("\n", "\r\n" or "\r").
std::string_view next_line(std::string_view& text);

/// Returns nothing for a word that is not a finite number. A comma is accepted as the decimal point.
std::optional<double> number_in(std::string_view word);

/// Like number_in(), for whole numbers.
std::optional<long long> whole_number_in(std::string_view word);

std::string lower_case(std::string_view text);

/// Reason why number_in() returns nothing, for messages: "…", which is no number; or a number that is not finite.
std::string why_no_number(std::string_view word);

/// Quotes a word for messages: at most 20 characters, with unprintable ones replaced.
std::string in_quotes(std::string_view word);

}  // namespace tandem::server::mesh_reader

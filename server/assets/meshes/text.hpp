// Splits text formats of meshes into words and lines, without copies. A word counts as a number only if the whole word
// is a number.
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

/// Removes the first word of `text` and returns it. Returns an empty word at the end.
std::string_view next_word(std::string_view& text);

/// Removes the first line of `text` and returns it without its end ("\n", "\r\n" or "\r").
std::string_view next_line(std::string_view& text);

/// Returns the number in a word; nothing if the word is not a finite number. A comma is accepted as the decimal point.
std::optional<double> number_in(std::string_view word);

/// Same as number_in(), for whole numbers.
std::optional<long long> whole_number_in(std::string_view word);

std::string lower_case(std::string_view text);

/// Returns the reason why number_in() refuses a word, for messages: the word is no number, or the number is not finite.
std::string why_no_number(std::string_view word);

/// Quotes a word for messages: at most 20 characters, with unprintable ones replaced.
std::string in_quotes(std::string_view word);

}  // namespace tandem::server::mesh_reader

// Small text functions for the readers of structures and parameters. Inputs may be hostile, so none of the functions
// fails for any input.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::server {

inline bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

inline char small_letter(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Returns whether text begins with `start`, ignoring case. `start` must be in lower case.
bool begins_with_any_case(std::string_view text, std::string_view start);

std::string_view trimmed(std::string_view text);

/// Returns columns first … last of a line with fixed columns, without outer blanks. Columns are counted from 1, as in
/// format descriptions; those beyond the end of the line are omitted.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last);

/// Splits a line into blank-separated words.
std::vector<std::string_view> words(std::string_view line);

/// Removes the first line from `rest` and returns it; accepts LF and CRLF.
std::string_view pop_line(std::string_view& rest);

/// Returns whether the whole of `field` is one finite number, and stores it in `value`.
bool parse_finite(std::string_view field, double& value);

/// Returns text for messages: at most 40 characters, with '?' for characters other than printable ASCII.
std::string printable_text(std::string_view text);

/// Returns quoted text for messages: at most 40 characters, with '?' for characters other than printable ASCII.
std::string quoted_text(std::string_view text);

}  // namespace tandem::server

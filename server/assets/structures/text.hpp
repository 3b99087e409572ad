// Small text helpers that the structure and parameter readers share. Inputs are hostile: nothing here can fail.
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

/// Whether text begins with `start`, which is in small letters, in letters of any case.
bool begins_with_any_case(std::string_view text, std::string_view start);

std::string_view trimmed(std::string_view text);

/// Columns first … last of a fixed-column line, counted from 1 as in format descriptions, without outer blanks;
/// what the line is too short for is missing.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last);

/// Blank-separated words.
std::vector<std::string_view> words(std::string_view line);

/// Cuts the first line off `rest`; knows LF and CRLF.
std::string_view take_line(std::string_view& rest);

/// True when the whole of `field` is one finite number.
bool parse_finite(std::string_view field, double& value);

/// For messages: at most 40 characters, other than printable ASCII as '?'.
std::string printable_text(std::string_view text);

/// For messages: in quotes, at most 40 characters, other than printable ASCII as '?'.
std::string quoted_text(std::string_view text);

}  // namespace tandem::server

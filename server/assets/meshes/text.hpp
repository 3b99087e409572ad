// Words and lines of text formats of meshes. Nothing is copied; every number is checked as a whole.
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

/// The first word, cut off `text`; empty at the end.
std::string_view next_word(std::string_view& text);

/// The first line without its end ("\n", "\r\n" or "\r"), cut off `text`.
std::string_view next_line(std::string_view& text);

/// Nothing for a word that is not a finite number; a comma stands for a decimal point.
std::optional<double> number_in(std::string_view word);

/// As number_in(), for whole numbers.
std::optional<long long> whole_number_in(std::string_view word);

std::string lower_case(std::string_view text);

/// Why number_in() gives nothing, for messages: "…", which is no number; or a number that is not finite.
std::string why_no_number(std::string_view word);

/// For messages: at most 20 characters, those that cannot be printed replaced.
std::string in_quotes(std::string_view word);

}  // namespace tandem::server::mesh_reader

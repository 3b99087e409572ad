#include "server/assets/meshes/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace tandem::server::mesh_reader {
namespace {

constexpr std::string_view kSpace = " \t\n\r\v\f";

/// Removes a plus sign, which from_chars refuses.
std::string_view unsigned_word(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

template <class Number>
std::optional<Number> parsed(std::string_view word) {
  Number value{};
  const char* const end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data(), end, value);
  if (error != std::errc() || rest != end) return std::nullopt;
  return value;
}

/// Returns whether a number is too small for double. from_chars reports the same error for numbers that are too small
/// and for numbers that are too large.
bool is_tiny(std::string_view word) {
  return word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
}

}  // namespace

std::string_view next_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  const std::string_view word = text.substr(0, std::min(text.find_first_of(kSpace), text.size()));
  text.remove_prefix(word.size());
  return word;
}

std::string_view next_line(std::string_view& text) {
  const std::string_view line = text.substr(0, std::min(text.find_first_of("\r\n"), text.size()));
  text.remove_prefix(line.size());
  if (text.starts_with("\r\n")) text.remove_prefix(1);
  if (!text.empty()) text.remove_prefix(1);
  return line;
}

std::optional<double> number_in(std::string_view word) {
  word = unsigned_word(word);
  std::array<char, 64> with_point{};
  if (word.find(',') != std::string_view::npos && word.size() <= with_point.size()) {
    std::ranges::replace_copy(word, with_point.begin(), ',', '.');
    word = {with_point.data(), word.size()};
  }
  double value = 0;
  const char* const end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data(), end, value);
  if (rest != end || word.empty()) return std::nullopt;
  if (error == std::errc::result_out_of_range && is_tiny(word)) return 0.0;
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long long> whole_number_in(std::string_view word) {
  return parsed<long long>(unsigned_word(word));
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](char c) { return 'A' <= c && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return lower;
}

std::string why_no_number(std::string_view word) {
  const std::string lower = lower_case(word);
  const bool is_number = lower.find("nan") != std::string::npos || lower.find("inf") != std::string::npos;
  return is_number ? "a number that is not finite" : in_quotes(word) + ", which is no number in range";
}

std::string in_quotes(std::string_view word) {
  std::string text(word.substr(0, 20));
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return '"' + text + (word.size() > 20 ? "…\"" : "\"");
}

}  // namespace tandem::server::mesh_reader

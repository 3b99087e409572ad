#include "lab/report/format.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace tandem::lab {
namespace {

constexpr std::string_view kMinus = "\u2212";
constexpr std::string_view kReplacement = "\uFFFD";

std::string not_finite_text(double value) {
  if (std::isnan(value)) return "\u2013";
  return value > 0 ? "\u221E" : std::string(kMinus) + "\u221E";
}

/// Formats a value in ASCII. A value that is rounded to zero gets no sign.
std::string plain(double value, std::chars_format format, int precision) {
  // The longest number in fixed notation has 309 digits before the point, a sign, the point and 17 decimals.
  std::array<char, 352> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, precision);
  std::string text(buffer.data(), result.ptr);
  if (text.starts_with('-') && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

std::string with_typographic_minus(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '-') {
      out += kMinus;
    } else {
      out += c;
    }
  }
  return out;
}

void strip_trailing_zeros(std::string& text) {
  if (text.find('.') == std::string::npos) return;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
}

struct CodePoint {
  char32_t value;
  std::size_t length;  ///< number of bytes; 0: ill-formed UTF-8, which is then skipped byte by byte
};

bool is_continuation(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

/// Decodes the first code point of `text`.
/// Source  The Unicode Standard 15, table 3-7: over-long forms, surrogates and values above U+10FFFF are ill-formed.
CodePoint decode(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return {lead, 1};
  const std::size_t length = lead >= 0xF0 ? 4 : (lead >= 0xE0 ? 3 : 2);
  if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return {0, 0};
  char32_t value = lead & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if (!is_continuation(text[i])) return {0, 0};
    value = (value << 6U) | (static_cast<unsigned char>(text[i]) & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = value >= 0xD800 && value <= 0xDFFF;
  if (value < kLeast[length] || is_surrogate || value > 0x10FFFF) return {0, 0};
  return {value, length};
}

bool is_unprintable(char32_t c) {
  const bool is_control = (c < 0x20 && c != '\t' && c != '\n') || (c >= 0x7F && c < 0xA0);
  const bool is_bidi_override = (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069);
  return is_control || is_bidi_override;
}

/// Returns whether a character is two columns wide in a monospaced font.
/// Source  Unicode 15, Annex #11 (East Asian Width): the blocks that contain nearly all characters of classes W and F,
///         and emoji
bool is_wide(char32_t c) {
  constexpr std::array<std::array<char32_t, 2>, 7> kBlocks = {{{0x1100, 0x115F},
                                                               {0x2E80, 0xA4CF},
                                                               {0xAC00, 0xD7A3},
                                                               {0xF900, 0xFAFF},
                                                               {0xFF00, 0xFF60},
                                                               {0x1F300, 0x1FAFF},
                                                               {0x20000, 0x3FFFD}}};
  return std::any_of(kBlocks.begin(), kBlocks.end(), [c](const auto& block) { return c >= block[0] && c <= block[1]; });
}

std::string_view entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

}  // namespace

std::string format_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return not_finite_text(value);
  return with_typographic_minus(plain(value, std::chars_format::fixed, std::clamp(decimals, 0, 17)));
}

std::string format_significant(double value, int digits) {
  if (!std::isfinite(value)) return not_finite_text(value);
  if (value == 0) return "0";
  const int mantissa_digits = std::clamp(digits, 1, 17) - 1;
  std::string scientific = plain(value, std::chars_format::scientific, mantissa_digits);
  const std::size_t e = scientific.find('e');
  // The exponent is taken after rounding: 9.99 with 2 digits gives 1.0e+01.
  const int exponent = std::stoi(scientific.substr(e + 1));
  std::string text;
  if (exponent >= -4 && exponent < 7) {
    text = plain(value, std::chars_format::fixed, std::max(0, mantissa_digits - exponent));
    strip_trailing_zeros(text);
  } else {
    text = scientific.substr(0, e);
    strip_trailing_zeros(text);
    text += "e" + std::to_string(exponent);
  }
  return with_typographic_minus(text);
}

std::string format_coordinate(double value) {
  if (!std::isfinite(value)) return "0";
  std::string text = plain(value, std::chars_format::fixed, 2);
  strip_trailing_zeros(text);
  return text;
}

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const CodePoint point = decode(text);
    const std::size_t length = std::max<std::size_t>(point.length, 1);
    const bool is_good = point.length != 0 && !is_unprintable(point.value);
    out += is_good ? text.substr(0, length) : kReplacement;
    text.remove_prefix(length);
  }
  return out;
}

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : printable(text)) {
    const std::string_view escaped = entity(c);
    if (escaped.empty()) {
      out += c;
    } else {
      out += escaped;
    }
  }
  return out;
}

std::size_t text_width(std::string_view text) {
  std::size_t width = 0;
  while (!text.empty()) {
    const CodePoint point = decode(text);
    width += is_wide(point.value) ? 2 : 1;
    text.remove_prefix(std::max<std::size_t>(point.length, 1));
  }
  return width;
}

std::string shortened(std::string_view text, std::size_t max_width) {
  if (text_width(text) <= max_width) return std::string(text);
  if (max_width == 0) return {};
  std::size_t width = 1;  // the ellipsis takes one column
  std::size_t end = 0;
  while (end < text.size()) {
    const CodePoint point = decode(text.substr(end));
    width += is_wide(point.value) ? 2 : 1;
    if (width > max_width) break;
    end += std::max<std::size_t>(point.length, 1);
  }
  return std::string(text.substr(0, end)) + "\u2026";
}

}  // namespace tandem::lab

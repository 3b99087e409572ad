// Formats numbers and text for readers. Everything that a report prints uses these functions. So the same data gives
// the same bytes on every machine and locale, and names from the network cannot become markup.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tandem::lab {

/// `value` with exactly `decimals` digits after the point, e.g. "−0.50". Never "−0.00"; "–" for NaN, "∞" for infinity.
/// In      decimals  0..17
std::string format_fixed(double value, int decimals);

/// `value` rounded to `digits` significant digits without trailing zeros; scientific outside 1e-4..1e7.
/// In      digits  1..17
std::string format_significant(double value, int digits);

/// A coordinate for SVG: at most two decimals, ASCII minus. A value that is not finite gives 0, so it does not break
/// the figure.
std::string format_coordinate(double value);

/// Text that is safe to print. Ill-formed UTF-8, control characters (terminals execute them) and bidirectional
/// overrides (they reorder the surrounding text) become U+FFFD.
std::string printable(std::string_view text);

/// Printable text for an HTML or SVG element or a quoted attribute: & < > " ' become entities.
std::string escape_html(std::string_view text);

/// Number of columns of `text` in a monospaced font: 2 for a wide East Asian character or emoji, else 1.
std::size_t text_width(std::string_view text);

/// Truncates `text` to a text_width() of `max_width`; truncated text ends with "…".
std::string shortened(std::string_view text, std::size_t max_width);

}  // namespace tandem::lab

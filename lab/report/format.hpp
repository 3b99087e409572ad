// Numbers and text as people read them. Everything that a report prints goes through here, so that the same
// data gives the same bytes on every machine and locale, and no name from the network becomes markup.
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

/// A coordinate for SVG: at most two decimals, ASCII minus. 0 when not finite, so that one bad number spoils no figure.
std::string format_coordinate(double value);

/// Text that is safe to print: what is not well-formed UTF-8, control characters (a terminal would obey them) and
/// bidirectional overrides (they reorder the text around a name) become U+FFFD.
std::string printable(std::string_view text);

/// Printable text for an HTML or SVG element or a quoted attribute: & < > " ' become entities.
std::string escape_html(std::string_view text);

/// Columns that `text` takes in a monospaced face: 2 a wide East Asian character or emoji, else 1.
std::size_t text_width(std::string_view text);

/// `text` cut to a text_width() of `max_width`, with "…" at its end when something was cut.
std::string shortened(std::string_view text, std::size_t max_width);

}  // namespace tandem::lab

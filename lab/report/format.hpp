// Formats numbers and text for readers. All reports use these functions. Therefore the same data gives the same bytes
// on every machine and in every locale. Names received over the network cannot become markup.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tandem::lab {

/// Returns `value` with exactly `decimals` digits after the point, e.g. "−0.50". It is never "−0.00". NaN gives "–" and
/// infinity gives "∞".
/// In      decimals  0..17
std::string format_fixed(double value, int decimals);

/// Returns `value` rounded to `digits` significant digits, without trailing zeros. Outside 1e-4..1e7 the scientific
/// notation is used.
/// In      digits  1..17
std::string format_significant(double value, int digits);

/// Returns a coordinate for SVG: at most two decimals, with ASCII minus. A value that is not finite gives 0, so that
/// the figure remains valid.
std::string format_coordinate(double value);

/// Returns text that is safe to print. Ill-formed UTF-8, control characters (which a terminal would execute) and
/// bidirectional overrides (which reorder the surrounding text) are replaced by U+FFFD.
std::string printable(std::string_view text);

/// Returns printable text for an HTML or SVG element or a quoted attribute. The characters & < > " ' are replaced by
/// entities.
std::string escape_html(std::string_view text);

/// Returns the number of columns of `text` in a monospaced font. A wide East Asian character or an emoji has 2 columns,
/// any other character 1.
std::size_t text_width(std::string_view text);

/// Truncates `text` so that its text_width() is at most `max_width`. Truncated text ends with "…".
std::string shortened(std::string_view text, std::size_t max_width);

}  // namespace tandem::lab

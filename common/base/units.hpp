// Parses quantities with units as people write them on a command line or in a file.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/base/time.hpp"

namespace tandem {

/// Parses a non-negative time such as "25ms", "1.5 s", "200us" or "10ns".
///
/// In      usual_unit  unit that the error message suggests if the number has no unit
/// Fails   std::invalid_argument, e.g. "'25' has no unit; write 25ms (ns, us, ms or s)"
Duration parse_duration(std::string_view text, std::string_view usual_unit = "ms");

/// Parses a fraction from 0 to `largest`, written as "1%" or "0.01".
///
/// Fails   std::invalid_argument, e.g. "'120%' is out of range; write 0% to 100%, or 0 to 1"
double parse_fraction(std::string_view text, double largest = 1.0);

/// Returns a count with its noun: "1 hole", "2 holes".
inline std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace tandem

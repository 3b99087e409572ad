// Quantities as people write them on a command line or in a file: a number with its unit.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/base/time.hpp"

namespace tandem {

/// Reads "25ms", "1.5 s", "200us" or "10ns"; not negative.
///
/// In      usual_unit  unit suggested when the number has none
/// Fails   std::invalid_argument, e.g. "'25' has no unit; write 25ms (ns, us, ms or s)"
Duration parse_duration(std::string_view text, std::string_view usual_unit = "ms");

/// Reads "1%" or "0.01" as a fraction from 0 to `largest`.
///
/// Fails   std::invalid_argument, e.g. "'120%' is out of range; write 0% to 100%, or 0 to 1"
double parse_fraction(std::string_view text, double largest = 1.0);

/// A count with its noun: "1 hole", "2 holes".
inline std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace tandem

// A claim: a measured value that must satisfy a bound. The result is not stored; holds() computes it from value and
// bound. Therefore the table, the JSON and the exit code cannot disagree.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

enum class Relation : std::uint8_t { kAtLeast, kAtMost, kBelow };

struct Check {
  std::string scope;  ///< subject of the claim, e.g. "pick up · alice"
  std::string claim;  ///< measured quantity, e.g. "hand speed in the settled hold phase"
  double value = 0;
  Relation relation = Relation::kAtLeast;
  double bound = 0;
  std::string unit;  ///< unit, e.g. "N"; empty for counts and ratios
  int decimals = 2;  ///< number of decimals of value and bound in the output

  /// Returns false if value or bound is NaN.
  bool holds() const;
  /// Returns the value with its unit: "0.52 N".
  std::string value_text() const;
  /// Returns the bound with its relation and unit: "≥ 0.30 N".
  std::string bound_text() const;
};

bool all_hold(std::span<const Check> checks);

/// Returns [{"scope", "claim", "value", "relation": "at_least" | "at_most" | "below", "bound", "unit", "holds"}, …]; a
/// value that is not finite is null.
boost::json::array to_json(std::span<const Check> checks);

/// Prints the checks as a table for a terminal, grouped by scope. Each line begins with "ok" or "FAILED". Below the
/// table it prints the number of failed checks, and the first failed check as a sentence.
void print_checks(std::ostream& out, std::span<const Check> checks);

}  // namespace tandem::lab

// A claim compared with a bound. holds() always computes the result from value and bound and never stores it, so the
// table, the JSON and the exit code cannot disagree.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

enum class Relation : std::uint8_t { kAtLeast, kAtMost, kBelow };

struct Check {
  std::string scope;  ///< subject of the claim: "pick up · alice"
  std::string claim;  ///< "hand speed in the settled hold phase"
  double value = 0;
  Relation relation = Relation::kAtLeast;
  double bound = 0;
  std::string unit;  ///< "N"; "" for counts and ratios
  int decimals = 2;  ///< decimals of value and bound in the output

  /// Returns false if value or bound is not a number.
  bool holds() const;
  /// "0.52 N"
  std::string value_text() const;
  /// "≥ 0.30 N"
  std::string bound_text() const;
};

bool all_hold(std::span<const Check> checks);

/// Returns [{"scope", "claim", "value", "relation": "at_least" | "at_most" | "below", "bound", "unit", "holds"}, …]; a
/// value that is not finite is null.
boost::json::array to_json(std::span<const Check> checks);

/// Prints a table for a terminal. Each scope lists its checks, "ok" or "FAILED" first, with aligned values. Then follow
/// the number of failed checks and the first of them as a sentence.
void print_checks(std::ostream& out, std::span<const Check> checks);

}  // namespace tandem::lab

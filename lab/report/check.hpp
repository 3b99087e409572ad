// A claim held against a number. Whether it holds is always worked out from value and bound, never stored, so
// that the table, the JSON and the exit code cannot disagree.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>

#include "common/base/json.hpp"

namespace tandem::lab {

enum class Relation : std::uint8_t { kAtLeast, kAtMost, kBelow };

struct Check {
  std::string scope;  ///< whom or what it is about: "pick up · alice"
  std::string claim;  ///< "hand speed in the settled hold phase"
  double value = 0;
  Relation relation = Relation::kAtLeast;
  double bound = 0;
  std::string unit;  ///< "N"; "" for counts and ratios
  int decimals = 2;  ///< of value and bound when shown

  /// False for a value or bound that is not a number.
  bool holds() const;
  /// "0.52 N"
  std::string value_text() const;
  /// "≥ 0.30 N"
  std::string bound_text() const;
};

bool all_hold(std::span<const Check> checks);

/// [{"scope", "claim", "value", "relation": "at_least" | "at_most" | "below", "bound", "unit", "holds"}, …]; a value
/// that is not finite is null.
boost::json::array to_json(std::span<const Check> checks);

/// A table for a terminal: under each scope its checks, "ok" or "FAILED" first, values aligned; then how many do
/// not hold, and the first of them in a sentence.
void print_checks(std::ostream& out, std::span<const Check> checks);

}  // namespace tandem::lab

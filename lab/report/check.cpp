#include "lab/report/check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <string_view>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

std::string_view symbol(Relation relation) {
  constexpr std::array<std::string_view, 3> kSymbols = {"≥", "≤", "<"};
  return kSymbols[static_cast<std::size_t>(relation)];
}

std::string_view word(Relation relation) {
  constexpr std::array<std::string_view, 3> kWords = {"at_least", "at_most", "below"};
  return kWords[static_cast<std::size_t>(relation)];
}

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

boost::json::value json_number(double value) {
  return std::isfinite(value) ? boost::json::value(value) : boost::json::value(nullptr);
}

}  // namespace

bool Check::holds() const {
  // If value or bound is NaN, these comparisons are false and the check fails.
  switch (relation) {
    case Relation::kAtLeast:
      return value >= bound;
    case Relation::kAtMost:
      return value <= bound;
    case Relation::kBelow:
      return value < bound;
  }
  return false;
}

std::string Check::value_text() const {
  return with_unit(format_fixed(value, decimals), unit);
}

std::string Check::bound_text() const {
  return std::string(symbol(relation)) + " " + with_unit(format_fixed(bound, decimals), unit);
}

bool all_hold(std::span<const Check> checks) {
  return std::all_of(checks.begin(), checks.end(), [](const Check& check) { return check.holds(); });
}

boost::json::array to_json(std::span<const Check> checks) {
  boost::json::array list;
  for (const Check& check : checks) {
    list.push_back(boost::json::object{{"scope", check.scope},
                                       {"claim", check.claim},
                                       {"value", json_number(check.value)},
                                       {"relation", word(check.relation)},
                                       {"bound", json_number(check.bound)},
                                       {"unit", check.unit},
                                       {"holds", check.holds()}});
  }
  return list;
}

void print_checks(std::ostream& out, std::span<const Check> checks) {
  std::size_t claim_width = 0;
  std::size_t value_width = 0;
  for (const Check& check : checks) {
    claim_width = std::max(claim_width, text_width(check.claim));
    value_width = std::max(value_width, text_width(check.value_text()));
  }
  const std::string* scope = nullptr;
  for (const Check& check : checks) {
    if (scope == nullptr || *scope != check.scope) out << printable(check.scope) << '\n';
    scope = &check.scope;
    const std::string value = check.value_text();
    out << (check.holds() ? "  ok      " : "  FAILED  ") << check.claim
        << std::string(claim_width - text_width(check.claim) + 2 + value_width - text_width(value), ' ') << value
        << "  " << check.bound_text() << '\n';
  }
  const auto failed = std::ranges::find_if_not(checks, &Check::holds);
  if (failed == checks.end()) {
    out << "All " << checks.size() << " checks hold.\n";
  } else {
    out << std::ranges::count_if(checks, [](const Check& check) { return !check.holds(); }) << " of " << checks.size()
        << " checks do not hold. The first: " << printable(failed->scope) << ": " << failed->claim << " is "
        << failed->value_text() << " instead of " << failed->bound_text() << ".\n";
  }
}

}  // namespace tandem::lab

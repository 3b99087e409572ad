#include "common/base/units.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

namespace tandem {
namespace {

struct TimeUnit {
  std::string_view name;
  double seconds;
};
constexpr std::array<TimeUnit, 7> kTimeUnits{
    {{"ns", 1e-9}, {"us", 1e-6}, {"ms", 1e-3}, {"s", 1.0}, {"min", 60.0}, {"h", 3600.0}, {"d", 86400.0}}};
// Largest accepted time: about ten years, far below the maximum of a Duration (292 years) and far above any sensible
// input.
constexpr double kLongest_s = 3.2e8;

/// A number and the remaining text after it.
struct NumberAndRest {
  double number = 0;
  std::string_view rest;
};
std::optional<NumberAndRest> split(std::string_view text) {
  NumberAndRest result;
  const char* const end = text.data() + text.size();
  const auto [next, error] = std::from_chars(text.data(), end, result.number);
  if (error != std::errc() || !std::isfinite(result.number)) return std::nullopt;
  result.rest = std::string_view(next, static_cast<std::size_t>(end - next));
  while (result.rest.starts_with(' ')) result.rest.remove_prefix(1);
  return result;
}

std::string quoted(std::string_view text) {
  std::string result(1, '\'');
  result.append(text);
  result.push_back('\'');
  return result;
}

}  // namespace

Duration parse_duration(std::string_view text, std::string_view usual_unit) {
  const std::optional<NumberAndRest> parts = split(text);
  if (!parts)
    throw std::invalid_argument(quoted(text) + " is not a time; write for example 25ms (ns, us, ms, s, min, h or d)");
  if (parts->rest.empty()) {
    throw std::invalid_argument(quoted(text) + " has no unit; write " + std::string(text) + std::string(usual_unit) +
                                " (ns, us, ms, s, min, h or d)");
  }
  for (const TimeUnit& unit : kTimeUnits) {
    if (parts->rest != unit.name) continue;
    const double seconds = parts->number * unit.seconds;
    if (seconds < 0 || seconds > kLongest_s) {
      throw std::invalid_argument(quoted(text) + " is out of range; it must be 0 to ten years");
    }
    return Duration(std::llround(seconds * 1e9));
  }
  throw std::invalid_argument(quoted(text) + " has the unknown unit " + quoted(parts->rest) +
                              "; use ns, us, ms, s, min, h or d");
}

double parse_fraction(std::string_view text, double largest) {
  const std::optional<NumberAndRest> parts = split(text);
  const bool is_percent = parts && parts->rest == "%";
  const bool is_number = parts && (is_percent || parts->rest.empty());
  if (is_number) {
    const double fraction = is_percent ? parts->number / 100 : parts->number;
    if (fraction >= 0 && fraction <= largest) return fraction;
  }
  std::ostringstream remedy;
  remedy << "write 0% to " << 100 * largest << "%, or 0 to " << largest;
  throw std::invalid_argument(quoted(text) + (is_number ? " is out of range; " : " is not a fraction; ") +
                              remedy.str());
}

}  // namespace tandem

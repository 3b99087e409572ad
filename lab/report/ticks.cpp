#include "lab/report/ticks.hpp"

#include <algorithm>
#include <cmath>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

/// Largest magnitude of a range limit. The sum and difference of two such limits cannot overflow.
constexpr double kLargest = 1e290;
/// Minimum relative width of a range. Narrower ranges cannot hold distinct ticks.
constexpr double kMinRelativeWidth = 1e-9;
/// Tolerance as a fraction of a step: a range limit that misses a multiple of the step only by rounding still gets a
/// tick.
constexpr double kSlack = 1e-6;

/// Distance of two ticks: m·10^e, with the mantissa m and the exponent e. They are stored separately, so that a tick
/// i·m·10^e is the double nearest to its decimal number.
struct TickStep {
  double mantissa = 1;
  int exponent = 0;

  double multiple(double i) const {
    const double power = std::pow(10.0, std::abs(exponent));
    return exponent < 0 ? i * mantissa / power : i * mantissa * power;
  }
};

/// The multiples of a step from `first` to `last`.
struct Multiples {
  TickStep step;
  double first = 0;
  double last = 0;
};

Multiples multiples_inside(Range range, const TickStep& step) {
  return {step, std::ceil(range.low / step.multiple(1) - kSlack), std::floor(range.high / step.multiple(1) + kSlack)};
}

Multiples multiples_around(Range range, const TickStep& step) {
  return {step, std::floor(range.low / step.multiple(1) + kSlack), std::ceil(range.high / step.multiple(1) - kSlack)};
}

/// Finds the smallest round step that gives at most `max_count` ticks.
Multiples few_multiples(Range range, std::size_t max_count, Multiples (*multiples)(Range, const TickStep&)) {
  const auto count = static_cast<double>(std::max<std::size_t>(max_count, 3));
  TickStep step;
  step.exponent = static_cast<int>(std::floor(std::log10((range.high - range.low) / count))) - 1;
  for (;; ++step.exponent) {
    for (const double mantissa : {1.0, 2.0, 5.0}) {
      step.mantissa = mantissa;
      const Multiples found = multiples(range, step);
      if (found.last - found.first + 1 <= count) return found;
    }
  }
}

std::vector<AxisMark> labelled(const Multiples& m) {
  const bool is_plain = m.step.exponent >= -6 && m.step.multiple(std::max(std::abs(m.first), std::abs(m.last))) < 1e7;
  std::vector<AxisMark> ticks;
  for (double i = m.first; i <= m.last; i += 1) {
    const double value = m.step.multiple(i);
    ticks.push_back(
        {value, is_plain ? format_fixed(value, std::max(0, -m.step.exponent)) : format_significant(value, 6)});
  }
  return ticks;
}

std::string log_label(double value) {
  return format_significant(value, 3);
}

}  // namespace

Range sane_linear(Range range) {
  if (!std::isfinite(range.low) || !std::isfinite(range.high)) return {0, 1};
  double low = std::clamp(std::min(range.low, range.high), -kLargest, kLargest);
  double high = std::clamp(std::max(range.low, range.high), -kLargest, kLargest);
  const double magnitude = std::max(std::abs(low), std::abs(high));
  if (magnitude < 1 / kLargest) return {0, 1};
  if (high - low < kMinRelativeWidth * magnitude) {
    low -= 0.5 * magnitude;
    high += 0.5 * magnitude;
  }
  return {low, high};
}

Range sane_log(Range range) {
  const bool is_usable = std::isfinite(range.low) && std::isfinite(range.high) && range.high > 0;
  if (!is_usable) return {1, 10};
  const double high = std::clamp(range.high, 2 / kLargest, kLargest);
  const double low = std::clamp(range.low, 1 / kLargest, high);
  if (high / low < 2) return {low / std::sqrt(2.0), high * std::sqrt(2.0)};
  return {low, high};
}

std::vector<AxisMark> ticks_inside(Range range, std::size_t max_count) {
  return labelled(few_multiples(sane_linear(range), max_count, multiples_inside));
}

std::vector<AxisMark> ticks_around(Range range, std::size_t max_count) {
  return labelled(few_multiples(sane_linear(range), max_count, multiples_around));
}

std::vector<AxisMark> log_ticks(Range range, std::size_t max_count) {
  const Range sane = sane_log(range);
  const int first = static_cast<int>(std::floor(std::log10(sane.low) + 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(sane.high) + 1e-9));
  const auto limit = static_cast<int>(std::max<std::size_t>(max_count, 2));
  const int decades = last - first + 1;
  const bool has_room = decades * 3 <= limit;
  const int stride = (decades + limit - 1) / limit;
  std::vector<AxisMark> ticks;
  for (int exponent = first; exponent <= last; exponent += stride) {
    for (const double mantissa : {1.0, 2.0, 5.0}) {
      if (mantissa > 1 && !has_room) break;
      const double value = TickStep{mantissa, exponent}.multiple(1);
      if (value >= sane.low * (1 - 1e-9) && value <= sane.high * (1 + 1e-9)) ticks.push_back({value, log_label(value)});
    }
  }
  return ticks;
}

}  // namespace tandem::lab

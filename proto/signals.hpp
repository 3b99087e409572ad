// Names and limits of the signals of a game (WIRE.md, "Signals"), for the server and for sources of signals.
#pragma once

#include <cmath>
#include <cstddef>
#include <string_view>

namespace tandem::proto {

inline constexpr std::size_t kMaxSignals = 8, kMaxSignalStates = 4, kMaxSignalNameBytes = 32;
inline constexpr double kMaxSignalValue = 1e6, kMaxSignalAge_s = 600;

/// Rule for the names of signals, as a part of error messages.
inline constexpr std::string_view kSignalNameRule = "must be 1 to 32 characters a-z, 0-9, _ - .";

inline bool is_signal_name(std::string_view name) noexcept {
  constexpr std::string_view kCharacters = "abcdefghijklmnopqrstuvwxyz0123456789_-.";
  return !name.empty() && name.size() <= kMaxSignalNameBytes &&
         name.find_first_not_of(kCharacters) == std::string_view::npos;
}

/// The next three functions check the ranges of a signal's numbers. They return false for a number that is not finite.
inline bool is_signal_value(double value) noexcept {
  return std::abs(value) <= kMaxSignalValue;
}
inline bool is_confidence(double confidence) noexcept {
  return confidence >= 0 && confidence <= 1;
}
inline bool is_signal_age(double age_s) noexcept {
  return age_s >= 0 && age_s <= kMaxSignalAge_s;
}

}  // namespace tandem::proto

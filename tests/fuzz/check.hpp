// Condition that a fuzz target requires of its results.
#pragma once

#include <cstdlib>

namespace tandem::fuzz {

/// Aborts in every build, unlike assert(); a fuzzer keeps the input that ended the program.
inline void check(bool is_good) {
  if (!is_good) std::abort();
}

}  // namespace tandem::fuzz

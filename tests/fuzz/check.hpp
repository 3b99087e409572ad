// The check that fuzz targets apply to their results.
#pragma once

#include <cstdlib>

namespace tandem::fuzz {

/// Aborts in every build, unlike assert(). A fuzzer stores the input that aborted the program.
inline void check(bool is_good) {
  if (!is_good) std::abort();
}

}  // namespace tandem::fuzz

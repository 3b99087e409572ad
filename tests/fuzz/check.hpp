// The check of results in fuzz targets.
#pragma once

#include <cstdlib>

namespace tandem::fuzz {

/// Aborts if `is_good` is false, in every build, unlike assert(). A fuzzer stores the input that aborted the program.
inline void check(bool is_good) {
  if (!is_good) std::abort();
}

}  // namespace tandem::fuzz

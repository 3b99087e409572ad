// What a fuzz target demands of what it has read.
#pragma once

#include <cstdlib>

namespace tandem::fuzz {

/// In every build; a fuzzer keeps the input that ended the program.
inline void check(bool is_good) {
  if (!is_good) std::abort();
}

}  // namespace tandem::fuzz

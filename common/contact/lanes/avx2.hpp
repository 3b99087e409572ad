// Selects one of the two kernels of each kind (lanes.hpp).
#pragma once

namespace tandem::contact {

/// Whether the kernels for AVX2 are used: by default if the processor has it. A test may set it while nothing else
/// runs.
inline bool& uses_avx2() {
#if defined(__x86_64__)
  static bool uses = __builtin_cpu_supports("avx2") != 0;
#else
  static bool uses = false;
#endif
  return uses;
}

}  // namespace tandem::contact

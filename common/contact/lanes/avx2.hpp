// Selects between the portable and the AVX2 version of each kernel (lanes.hpp).
#pragma once

namespace tandem::contact {

/// Whether the AVX2 versions of the kernels are used; by default, if the processor supports AVX2. A test may change the
/// value while no other thread runs a kernel.
inline bool& uses_avx2() {
#if defined(__x86_64__)
  static bool uses = __builtin_cpu_supports("avx2") != 0;
#else
  static bool uses = false;
#endif
  return uses;
}

}  // namespace tandem::contact

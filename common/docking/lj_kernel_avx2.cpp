// Compiled with AVX2 and FMA switched on: called only after a check of the CPU, see lj_kernel.hpp.
#define TANDEM_LJ_EVALUATE evaluate_avx2
#define TANDEM_LJ_BYTES 32
#include "common/docking/lj_kernel_body.inc"

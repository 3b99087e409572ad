// Compiled with AVX-512F switched on: called only after a check of the CPU, see lj_kernel.hpp.
#define TANDEM_LJ_EVALUATE evaluate_avx512
#define TANDEM_LJ_BYTES 64
#include "common/docking/lj_kernel_body.inc"

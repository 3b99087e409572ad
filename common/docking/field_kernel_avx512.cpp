// The field kernels compiled with AVX-512F. They are called only after a check of the CPU, see field_kernel.hpp.
#define TANDEM_ALL_PAIRS all_pairs_avx512
#define TANDEM_NEAR near_avx512
#define TANDEM_FAR_POINTS far_points_avx512
#define TANDEM_GRID grid_avx512
#define TANDEM_MULTIPLY_ADDS multiply_adds_avx512
#define TANDEM_FIELD_BYTES 64
#include "common/docking/field_kernel_body.inc"

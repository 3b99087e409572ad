// The field kernels compiled with AVX2 and FMA. They are called only after a check of the CPU, see field_kernel.hpp.
#define TANDEM_ALL_PAIRS all_pairs_avx2
#define TANDEM_NEAR near_avx2
#define TANDEM_NEAR_CHILDREN near_children_avx2
#define TANDEM_FAR_POINTS far_points_avx2
#define TANDEM_GRID grid_avx2
#define TANDEM_MULTIPLY_ADDS multiply_adds_avx2
#define TANDEM_FIELD_BYTES 32
#include "common/docking/field_kernel_body.inc"

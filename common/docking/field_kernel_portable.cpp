// The field kernels compiled with the compiler options of the whole program, so every CPU that it supports can run
// them.
#define TANDEM_ALL_PAIRS all_pairs_portable
#define TANDEM_NEAR near_portable
#define TANDEM_NEAR_CHILDREN near_children_portable
#define TANDEM_FAR_POINTS far_points_portable
#define TANDEM_GRID grid_portable
#define TANDEM_MULTIPLY_ADDS multiply_adds_portable
#define TANDEM_FIELD_BYTES 16
#include "common/docking/field_kernel_body.inc"

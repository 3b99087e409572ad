// The kernel that every CPU of the build's target runs (four lanes; SSE2 on x86-64).
#define TANDEM_LJ_EVALUATE evaluate_portable
#define TANDEM_LJ_BYTES 16
#include "common/docking/lj_kernel_body.inc"

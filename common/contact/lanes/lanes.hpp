// Vectors of four numbers ("lanes"). The source of each kernel is compiled twice (twice.inc): for any processor, and
// for processors with AVX2. Both versions have the same operations in the same order, without fused multiply-add.
// Results therefore do not depend on the processor.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/contact/lanes/avx2.hpp"

#define TANDEM_KERNEL "common/contact/lanes/operations.inc"
#include "common/contact/lanes/twice.inc"

// Vectors of four numbers. A kernel is compiled twice from one text (twice.inc), for any processor and for those with
// AVX2. Both versions have the same operations in the same order, none of them contracted, so that results do not
// depend on the processor.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "common/contact/lanes/avx2.hpp"

#define TANDEM_KERNEL "common/contact/lanes/operations.inc"
#include "common/contact/lanes/twice.inc"

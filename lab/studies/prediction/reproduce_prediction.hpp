// The prediction of the source thesis beside ours: a force that comes 200 times a second, shown 1000 times.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapter 6
#pragma once

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// In      clock  what the cost of a fit is measured with
Reproduction reproduce_prediction(const Clock& clock);

}  // namespace tandem::lab

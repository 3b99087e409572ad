// Compares the prediction of the source thesis with ours: a force is received at 200 Hz and displayed at 1000 Hz.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapter 6
#pragma once

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// Runs the comparison.
/// In      clock  measures the duration of a fit
Reproduction reproduce_prediction(const Clock& clock);

}  // namespace tandem::lab

// The comparisons of rendering laws in the source thesis, run again in the hand rig, and those that it lacks.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapters 4 and 5
#pragma once

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// How far a tool of each mass hangs below a handle that is held still.
Reproduction reproduce_displacement(const Clock& clock);
/// What of a hard press gets past the force limit, and where the curve bends.
Reproduction reproduce_saturation(const Clock& clock);
/// What the hand feels above 30 Hz while it tries to press steadily with a light tool.
Reproduction reproduce_buzz(const Clock& clock);
/// Force on the way in and on the way out, and what comes out of it.
Reproduction reproduce_growth(const Clock& clock);
/// How stiff each law can be on a sampled device: predicted from the loop, and tried.
Reproduction reproduce_zwidth(const Clock& clock);

}  // namespace tandem::lab

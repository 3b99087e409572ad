// Repeats the comparisons of rendering laws in the source thesis with the hand rig, and adds further comparisons.
//
// Source  Hou Xiyuan, "Stable Haptic Rendering in Virtual Environment", PhD thesis, NTU, 2014, chapters 4 and 5
#pragma once

#include "common/base/time.hpp"
#include "lab/results/reproduction.hpp"

namespace tandem::lab {

/// Displacement ("sag") of a tool of each mass below a handle that does not move.
Reproduction reproduce_displacement(const Clock& clock);
/// Force of a hard press in excess of the force limit, and force at which saturation begins.
Reproduction reproduce_saturation(const Clock& clock);
/// Force on the hand above 30 Hz during a steady press with a light tool.
Reproduction reproduce_buzz(const Clock& clock);
/// Force during loading and unloading, and the energy that their difference generates.
Reproduction reproduce_growth(const Clock& clock);
/// Largest stable stiffness of each law on a sampled device: predicted from the loop, and simulated.
Reproduction reproduce_zwidth(const Clock& clock);

}  // namespace tandem::lab

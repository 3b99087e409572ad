// The buttons of a haptic device, the same in a device's sample, on the wire and in a hand's path.
#pragma once

#include <cstdint>

namespace tandem {

/// Bits of DeviceSample::buttons and ClientUpdate::buttons.
enum Button : std::uint32_t {
  kButtonGrab = 1U << 0U,    ///< held down: grab the nearest body in reach; let go: release it
  kButtonClutch = 1U << 1U,  ///< held down: the tool stays while the hand moves back
};

}  // namespace tandem

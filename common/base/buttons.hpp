// Button bits of a haptic device. Device samples, wire messages and recorded hand paths use the same bits.
#pragma once

#include <cstdint>

namespace tandem {

/// Bits of DeviceSample::buttons and ClientUpdate::buttons.
enum Button : std::uint32_t {
  kButtonGrab = 1U << 0U,    ///< held: the tool grabs the nearest body in reach; released: the tool lets the body go
  kButtonClutch = 1U << 1U,  ///< held: the tool keeps its pose while the user moves the handle back into reach
};

}  // namespace tandem

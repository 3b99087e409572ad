// The buttons of a haptic device. Device samples, wire messages and recorded hand paths share these bits.
#pragma once

#include <cstdint>

namespace tandem {

/// Bits of DeviceSample::buttons and ClientUpdate::buttons.
enum Button : std::uint32_t {
  kButtonGrab = 1U << 0U,    ///< held: the tool grabs the nearest body in reach; released: it releases the body
  kButtonClutch = 1U << 1U,  ///< held: the tool keeps its pose while the user moves the handle back
};

}  // namespace tandem

// Where somebody who looks at the scene points: what a window gives to the device "mouse".
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::devices {

struct PointerTarget {
  Pose X_DH;                  ///< where the hand should be, in the device base frame
  std::uint32_t buttons = 0;  ///< bits of Button
};

/// Thread  written by the window's, read by the haptic one
using Pointer = realtime::Mailbox<PointerTarget>;

}  // namespace tandem::devices

// Target of the hand of the device "mouse": set by the mouse in a window, or by the commands of a script.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::devices {

/// Farthest place of the hand from the device's base: a target beyond it is moved there.
inline constexpr double kPointerReach_m = 0.5;

struct PointerTarget {
  Pose X_DH;                  ///< of the hand, in the device base frame
  std::uint32_t buttons = 0;  ///< bits of Button
};

/// Thread  written by the main one, read by the haptic one
using Pointer = realtime::Mailbox<PointerTarget>;

}  // namespace tandem::devices

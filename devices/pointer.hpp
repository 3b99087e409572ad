// Target pose for the hand of the device "mouse". A window sets it from the user's mouse, or a script by its commands.
#pragma once

#include <cstdint>

#include "common/base/spatial.hpp"
#include "common/realtime/mailbox.hpp"

namespace tandem::devices {

/// Maximum distance of the hand from the origin of the device's base frame [m]. A target beyond it is moved to this
/// distance.
inline constexpr double kPointerReach_m = 0.5;

struct PointerTarget {
  Pose X_DH;                  ///< pose of the hand in the device base frame
  std::uint32_t buttons = 0;  ///< pressed buttons, as bits of Button
};

/// Mailbox in which the newest target replaces older ones.
/// Thread  the main thread writes, the haptic thread reads
using Pointer = realtime::Mailbox<PointerTarget>;

}  // namespace tandem::devices

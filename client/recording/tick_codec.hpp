// Conversion between a haptic tick and a message of a recording.
#pragma once

#include "client/haptics/tick_record.hpp"
#include "tandem/recording.pb.h"

namespace tandem::client {

/// Converts a tick to a message.
/// In      phase  index of the present phase of the simulated hand's path; −1: none
wire::RecordedTick recorded(const TickRecord& tick, int phase);
/// Converts a message to a tick. Non-finite values and invalid rotations are kept, so that recordings of faults can be
/// displayed. Because the file may be damaged, the `sample` must be used only through devices::DeviceReader.
TickRecord tick_of(const wire::RecordedTick& recorded);

}  // namespace tandem::client

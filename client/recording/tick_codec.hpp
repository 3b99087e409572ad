// Conversion between a haptic tick and a message of a recording.
#pragma once

#include "client/haptics/tick_record.hpp"
#include "tandem/recording.pb.h"

namespace tandem::client {

/// In      phase  index in the simulated hand's path; −1: none
wire::RecordedTick recorded(const TickRecord& tick, int phase);
/// Non-finite values and invalid rotations are kept unchanged, because a recording is read for display. Use `sample` of
/// a damaged file only through devices::DeviceReader.
TickRecord tick_of(const wire::RecordedTick& recorded);

}  // namespace tandem::client

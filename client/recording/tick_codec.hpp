// A haptic tick as a message of a recording, and back.
#pragma once

#include "client/haptics/tick_record.hpp"
#include "tandem/recording.pb.h"

namespace tandem::client {

/// In      phase  of the simulated hand's path; −1: none
wire::RecordedTick recorded(const TickRecord& tick, int phase);
/// What is not finite, or no rotation, is as the message has it: a recording is read to be shown. Use `sample` of a damaged
/// file only through devices::DeviceReader.
TickRecord tick_of(const wire::RecordedTick& recorded);

}  // namespace tandem::client

// Conversion between a haptic tick and a message of a recording.
#pragma once

#include "client/haptics/tick_record.hpp"
#include "tandem/recording.pb.h"

namespace tandem::client {

/// In      phase  index of the phase in the simulated hand's trajectory; −1: none
wire::RecordedTick recorded(const TickRecord& tick, int phase);
/// Keeps non-finite values and invalid rotations, because a recording is read for display. Therefore `sample` of a
/// damaged file must be used only through devices::DeviceReader.
TickRecord tick_of(const wire::RecordedTick& recorded);

}  // namespace tandem::client

// What the room's operator sets of it, as text.
#pragma once

#include <string>
#include <utility>

#include "common/base/time.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// "coupling.law=spring-damper", "coupling.stiffness_n_per_m=400@5s": what, and how long after joining.
///
/// Fails   std::invalid_argument: no such parameter, or a value that no room accepts; what the scene makes of it is the
///         server's to say
std::pair<Duration, wire::SetParameter> parameter_to_set(const std::string& text);

}  // namespace tandem::client

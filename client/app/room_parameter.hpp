// Room parameters that the operator sets, as text.
#pragma once

#include <string>
#include <utility>

#include "common/base/time.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Parses "coupling.law=spring-damper" or "coupling.stiffness_n_per_m=400@5s": name, value, and time after joining.
///
/// Fails   std::invalid_argument: no such parameter, or a value that no room accepts. Limits that depend on the scene
///         are checked by the server.
std::pair<Duration, wire::SetParameter> parameter_to_set(const std::string& text);

}  // namespace tandem::client

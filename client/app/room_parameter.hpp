// Parses the room parameters that the operator sets on the command line.
#pragma once

#include <string>
#include <utility>

#include "common/base/time.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

/// Parses "coupling.law=spring-damper" or "coupling.stiffness_n_per_m=400@5s": name, value, and optionally the time
/// after the join.
///
/// Fails   std::invalid_argument for an unknown parameter, or a value that no room accepts. The server checks limits
///         that depend on the scene.
std::pair<Duration, wire::SetParameter> parameter_to_set(const std::string& text);

}  // namespace tandem::client

// A signal as a line of text: "name value [confidence [age]]", the age in seconds.
#pragma once

#include <string>

#include "client/signals/signal_session.hpp"

namespace tandem::client {

inline constexpr std::size_t kMaxSignalLineBytes = 256;

struct SignalLine {
  Signal signal;
  Duration age{};
};

/// Parses a line.
/// Fails   std::invalid_argument if the line is malformed or a value is out of range; the message for the user names
///         the value and the remedy
SignalLine parse_signal_line(const std::string& line);

}  // namespace tandem::client

// Command-line options of tandem-client that select the devices for the user's hands.
#pragma once

#include <optional>
#include <string>

#include "devices/registry.hpp"

namespace CLI {
class App;
}

namespace tandem::client {

/// Declares and evaluates the device options. It opens no device.
class DeviceCommandLine {
 public:
  /// Adds the device options to the command line.
  /// In      first  options of the first device, set during parsing; must outlive the parser
  void declare(CLI::App& app, devices::DeviceOptions& first);
  /// Replaces the device "auto" by a real device, finds the profile, and reads the file of a recorded hand. Must be
  /// called after parsing.
  /// In      has_pointer  true: a window or commands can move the device "mouse"
  /// Out     options of the device for the user's other hand; none if there is only one device
  /// Fails   std::invalid_argument if an option has a wrong value; the message names the option, the value and the
  ///         remedy
  std::optional<devices::DeviceOptions> complete(const CLI::App& app, devices::DeviceOptions& first, bool has_pointer);

 private:
  std::string profile_;
  devices::DeviceOptions second_;
};

}  // namespace tandem::client

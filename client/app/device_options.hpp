// The options of tandem-client that select the devices of the user's hands.
#pragma once

#include <optional>
#include <string>

#include "devices/registry.hpp"

namespace CLI {
class App;
}

namespace tandem::client {

/// Device options of the command line, evaluated before a device is opened.
class DeviceCommandLine {
 public:
  /// In      first  filled in when the command line is parsed, and by complete(); must outlive the parser
  void declare(CLI::App& app, devices::DeviceOptions& first);
  /// Resolves the device "auto", finds the profile and reads the file of a recorded hand. Call after parsing.
  /// In      has_pointer  a window or commands move the device "mouse"
  /// Out     device of the user's other hand; none: one device
  /// Fails   std::invalid_argument naming the option, its value and the remedy
  std::optional<devices::DeviceOptions> complete(const CLI::App& app, devices::DeviceOptions& first, bool has_pointer);

 private:
  std::string profile_;
  devices::DeviceOptions second_;
};

}  // namespace tandem::client

// The options of tandem-client that say which device the user's hands hold.
#pragma once

#include <optional>
#include <string>

#include "devices/registry.hpp"

namespace CLI {
class App;
}

namespace tandem::client {

/// What the command line says of devices, before anything is opened.
class DeviceCommandLine {
 public:
  /// In      first  filled in when the command line is parsed, and by complete(); must outlive the parser
  void declare(CLI::App& app, devices::DeviceOptions& first);
  /// After parsing: which device "auto" is, its profile, and what is in the file of a recorded hand.
  /// In      has_pointer  a window or commands move the device "mouse"
  /// Out     the device of the user's other hand; none: one device
  /// Fails   std::invalid_argument naming the option, its value and the remedy
  std::optional<devices::DeviceOptions> complete(const CLI::App& app, devices::DeviceOptions& first, bool has_pointer);

 private:
  std::string profile_;
  devices::DeviceOptions second_;
};

}  // namespace tandem::client

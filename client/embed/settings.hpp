// Checks the settings of the C interface and converts them to those of the client.
#pragma once

#include <memory>
#include <vector>

#include "client/embed/c/tandem.h"
#include "client/embed/own_device.hpp"
#include "client/net/client_io.hpp"
#include "devices/registry.hpp"

namespace tandem::client::embed {

struct ClientConfig {
  ClientIoSettings io;
  devices::DeviceOptions device;          ///< device to open; unused if own_device is set
  std::shared_ptr<OwnDevice> own_device;  ///< device that the program drives; null: the library opens a device
  int realtime_priority = 0;
};

/// Converts the settings of a client.
/// In      own_device  device whose handle is in the settings; null if the handle is 0
/// Fails   StatusError or std::invalid_argument if a setting is invalid; the message names the field, the value and the
///         remedy
ClientConfig config_of(const tandem_client_settings& settings, std::shared_ptr<OwnDevice> own_device);
/// Returns the profile of a device that the program drives.
/// Fails   like config_of()
devices::DeviceProfile profile_of(const tandem_device_settings& settings);

}  // namespace tandem::client::embed

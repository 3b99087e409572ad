// Settings of the C interface, checked and converted to those of the client.
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
  devices::DeviceOptions device;          ///< unused if there is an own device
  std::shared_ptr<OwnDevice> own_device;  ///< null: the library opens the device
  int realtime_priority = 0;
};

/// In      own_device  device with the handle of the settings; null if the handle is 0
/// Fails   StatusError or std::invalid_argument: the message names the field, the value and the remedy
ClientConfig config_of(const tandem_client_settings& settings, std::shared_ptr<OwnDevice> own_device);
/// Returns the profile of a device of the caller.
/// Fails   as config_of()
devices::DeviceProfile profile_of(const tandem_device_settings& settings);

}  // namespace tandem::client::embed

// The devices that this program can open, by name. devices/README.md has the recipe for another one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/device.hpp"
#include "devices/device_profile.hpp"
#include "devices/hand_parameters.hpp"

namespace tandem::devices {

/// What a device is opened with; each takes what concerns it.
struct DeviceOptions {
  std::string name = "sim";        ///< which device, of device_kinds()
  DeviceProfile profile;           ///< limits, encoder and mass: which real device the simulated hand holds
  std::string hand = "rest";       ///< what a simulated hand intends: find_hand_path()
  HandParameters hand_parameters;  ///< of a simulated hand, without the device
  std::uint64_t seed = 1;          ///< of a simulated hand's tremor
};

/// One kind of device. A folder of devices/ defines one, by a function `DeviceKind NAME_device()`.
struct DeviceKind {
  std::string_view name;         ///< as on the command line
  std::string_view description;  ///< one line
  /// Returns at once: what takes time, homing too, happens behind read(), which reports the state meanwhile.
  /// Fails   std::invalid_argument or std::runtime_error, which say what would help
  std::unique_ptr<Device> (*open)(const DeviceOptions& options);
};

const std::vector<DeviceKind>& device_kinds();

/// Fails   std::invalid_argument for a name that device_kinds() does not have; it names those that exist and, when it
///         is the name of a profile or a file with one, how a simulated hand holds such a device
void check_device_name(std::string_view name);

/// Fails   as check_device_name(), and as the device's own open
std::unique_ptr<Device> open_device(const DeviceOptions& options);

}  // namespace tandem::devices

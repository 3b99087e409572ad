// Registry entry of the device "mouse".
#include "devices/mouse/mouse_device.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {

DeviceKind mouse_device() {
  return {"mouse", "mouse and keys in the window, or the commands of --commands; with the limits of --profile", "sim",
          [](const DeviceOptions& options) -> std::unique_ptr<Device> {
            return std::make_unique<MouseDevice>(options.profile.spec, MouseDevice::default_hand(), options.pointer,
                                                 open_rumble(options.rumble));
          },
          nullptr};
}

}  // namespace tandem::devices

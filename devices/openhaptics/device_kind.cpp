// The device "openhaptics" as the registry knows it.
#include "devices/openhaptics/open_haptics.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {

// Where its workspace lies about the SDK's origin is not known for all of them: no border.
DeviceKind openhaptics_device() {
  return {"openhaptics", "Touch or Phantom by its maker's OpenHaptics, untested on hardware; --library, --profile",
          "touch",
          [](const DeviceOptions& options) -> std::unique_ptr<Device> {
            auto driver = std::make_unique<OpenHapticsDriver>(options.profile.spec, hd_functions(options.library));
            return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority);
          },
          nullptr};
}

}  // namespace tandem::devices

// Registry entry of the device "openhaptics".
#include "devices/openhaptics/open_haptics.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {

// The spec contains no workspace. For some models, the position of the workspace relative to the origin of the SDK is
// unknown.
DeviceKind openhaptics_device() {
  return {"openhaptics", "Touch or Phantom by its maker's OpenHaptics, untested on hardware; --library, --profile",
          "touch",
          [](const DeviceOptions& options) -> std::unique_ptr<Device> {
            auto driver = std::make_unique<OpenHapticsDriver>(
                options.profile.spec, hd_functions(options.library, options.setting("library")));
            return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority);
          },
          nullptr};
}

}  // namespace tandem::devices

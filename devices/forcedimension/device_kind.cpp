// Registry entry of the device "forcedimension".
#include "devices/forcedimension/force_dimension.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {

DeviceKind forcedimension_device() {
  return {"forcedimension", "omega, delta or sigma by their maker's SDK, untested on hardware; --library, --profile",
          "omega.3",
          [](const DeviceOptions& options) -> std::unique_ptr<Device> {
            DeviceSpec spec = options.profile.spec;
            spec.position_step_m = options.profile.position_step_m.value;
            spec.rotation_step_rad = options.profile.rotation_step_rad.value;
            spec.workspace_m = options.profile.workspace_m;
            auto driver = std::make_unique<ForceDimensionDriver>(
                std::move(spec), dhd_functions(options.library, options.setting("library")));
            return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority);
          },
          nullptr};
}

}  // namespace tandem::devices

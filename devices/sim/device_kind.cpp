// The device "sim" as the registry knows it.
#include "devices/registry.hpp"
#include "devices/sim/sim_device.hpp"

namespace tandem::devices {

DeviceKind sim_device() {
  return {"sim", "a simulated hand that holds the device of --profile", "sim",
          [](const DeviceOptions& options) -> std::unique_ptr<Device> {
            return std::make_unique<SimDevice>(options.profile.spec, holding(options.hand_parameters, options.profile),
                                               find_hand_path(options.hand), options.seed);
          },
          nullptr};
}

}  // namespace tandem::devices

// Registry entry of the device "sim".
#include "devices/registry.hpp"
#include "devices/sim/sim_device.hpp"
#include "devices/sim/told_motors.hpp"

namespace tandem::devices {
namespace {

std::unique_ptr<Device> open_sim(const DeviceOptions& options) {
  auto device = std::make_unique<SimDevice>(options.profile.spec, holding(options.hand_parameters, options.profile),
                                            hand_path_of(options), options.seed);
  if (options.motors.empty()) return device;
  return std::make_unique<ToldMotors>(std::move(device), options.motors, options.realtime_priority,
                                      options.setting("motors"));
}

}  // namespace

DeviceKind sim_device() {
  return {"sim", "a simulated hand that holds the device of --profile", "sim", open_sim, nullptr};
}

}  // namespace tandem::devices

// Registry entry of the device "inverse3".
#include <chrono>
#include <stdexcept>
#include <utility>

#include "devices/inverse3/inverse3_driver.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {
namespace {

constexpr Duration kProbeTime = std::chrono::milliseconds(300);

/// Waits for a state of the service that shows whether the device can be used. Returns this state, or the last one if
/// none arrives within kProbeTime.
DeviceSample probe(Inverse3Driver& driver) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + kProbeTime;
  DeviceSample sample;
  bool is_decided = false;
  while (!is_decided && clock.now() < end) {
    sample = driver.step(clock.now(), {});
    is_decided = sample.state == DeviceState::kReady || !sample.reason.empty();
  }
  return sample;
}

std::unique_ptr<Device> open_inverse3(const DeviceOptions& options) {
  DeviceSpec spec = options.profile.spec;
  spec.position_step_m = options.profile.position_step_m.value;
  const auto watchdog = std::make_shared<Watchdog>(options.realtime_priority);
  auto driver = std::make_unique<Inverse3Driver>(
      std::move(spec), inverse3_endpoint(options.service, options.setting("service")), watchdog);
  const DeviceSample sample = probe(*driver);
  if (sample.state != DeviceState::kReady && !sample.reason.empty()) {
    throw std::runtime_error("device inverse3, " + options.service + ": " + std::string(sample.reason) +
                             "; without one use --device sim");
  }
  return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority, watchdog);
}

std::vector<FoundDevice> find_inverse3() {
  const std::string service = DeviceOptions().service;
  Inverse3Driver driver(DeviceSpec{}, inverse3_endpoint(service));
  if (probe(driver).state != DeviceState::kReady) return {};
  return {{"its service at " + service, ""}};
}

}  // namespace

DeviceKind inverse3_device() {
  return {"inverse3", "a Haply Inverse3: three axes, by its maker's service; --service", "inverse3", open_inverse3,
          find_inverse3};
}

}  // namespace tandem::devices

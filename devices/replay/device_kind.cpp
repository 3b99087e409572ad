// Registry entry of the device "replay".
#include <stdexcept>

#include "devices/registry.hpp"
#include "devices/replay/replay_device.hpp"

namespace tandem::devices {
namespace {

std::unique_ptr<Device> open_replay(const DeviceOptions& options) {
  if (options.recorded == nullptr) {
    throw std::invalid_argument("replay needs a recording: --device replay:FILE.mcap, of tandem-client --record");
  }
  return std::make_unique<ReplayDevice>(options.profile.spec, options.recorded);
}

}  // namespace

DeviceKind replay_device() {
  return {"replay", "the hand of a recording again, as replay:FILE", "sim", open_replay, nullptr};
}

}  // namespace tandem::devices

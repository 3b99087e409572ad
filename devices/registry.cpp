// The generated file device_list.inc contains a line TANDEM_DEVICE(NAME) for each device folder of CMakeLists.txt.
#include "devices/registry.hpp"

#include <algorithm>
#include <stdexcept>

namespace tandem::devices {

#define TANDEM_DEVICE(name) DeviceKind name##_device();
#include "device_list.inc"
#undef TANDEM_DEVICE

namespace {

bool is_profile(std::string_view name) {
  if (name.ends_with(".json")) return true;
  const std::vector<DeviceProfile> profiles = load_device_profiles(shipped_device_profiles());
  return std::ranges::find(profiles, name, &DeviceProfile::name) != profiles.end();
}

}  // namespace

const std::vector<DeviceKind>& device_kinds() {
  static const std::vector<DeviceKind> kinds{
#define TANDEM_DEVICE(name) name##_device(),
#include "device_list.inc"
#undef TANDEM_DEVICE
  };
  return kinds;
}

HandPath hand_path_of(const DeviceOptions& options) {
  return find_hand_path(options.hand).shifted(options.hand_shift);
}

const DeviceKind& find_device_kind(std::string_view name) {
  const auto found = std::ranges::find(device_kinds(), name, &DeviceKind::name);
  if (found != device_kinds().end()) return *found;
  const std::string quoted = "\"" + std::string(name) + "\"";
  if (is_profile(name)) {
    throw std::invalid_argument(quoted + " has no driver in this version; for a simulated hand that holds one use " +
                                "--device sim --profile " + std::string(name));
  }
  std::string known;
  for (const DeviceKind& kind : device_kinds()) known += (known.empty() ? "" : ", ") + std::string(kind.name);
  throw std::invalid_argument(quoted + " is not known; use one of: " + known);
}

std::string choose_device(bool may_be_real, const std::function<void(const std::string&)>& log,
                          const std::vector<DeviceKind>& kinds) {
  for (const DeviceKind& kind : kinds) {
    if (!may_be_real || kind.find == nullptr) continue;
    for (const FoundDevice& found : kind.find()) {
      const std::string where = std::string(kind.name) + " (" + found.where + ")";
      log("device " + where +
          (found.problem.empty() ? " is used; --device sim for none" : " is not used: " + found.problem));
      if (found.problem.empty()) return std::string(kind.name);
    }
  }
  return "sim";
}

std::unique_ptr<Device> open_device(const DeviceOptions& options) {
  return find_device_kind(options.name).open(options);
}

}  // namespace tandem::devices

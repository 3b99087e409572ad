// Registry entry of the device "falcon".
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "devices/falcon/falcon_driver.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {
namespace {

constexpr std::size_t kMaxFirmware = 65536;  // known firmware files have about 8000 bytes

std::vector<std::uint8_t> firmware_of(const DeviceOptions& options) {
  const std::filesystem::path& path = options.firmware;
  if (path.empty()) return {};
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  const std::string named = options.setting("firmware") + ": " + path.string();
  if (!file.is_open() || bytes.empty()) {
    throw std::runtime_error(named + " cannot be read or is empty; name the firmware file that came with the device");
  }
  if (bytes.size() > kMaxFirmware)
    throw std::runtime_error(named + " has more than 64 KiB; it is no Falcon's firmware");
  return bytes;
}

std::unique_ptr<Device> open_falcon(const DeviceOptions& options) {
  FalconSettings settings{options.profile.spec, firmware_of(options), options.motor_counts_per_n_m};
  settings.spec.workspace_m = options.profile.workspace_m;
  settings.spec.position_step_m = options.profile.position_step_m.value;
  const auto watchdog = std::make_shared<Watchdog>(options.realtime_priority);
  const OpenFalcon open_port = [watchdog](std::string_view& why) { return open_falcon_usb_port(why, watchdog.get()); };
  std::string_view reason;
  auto port = open_port(reason);
  if (!port) throw std::runtime_error("device falcon: " + std::string(reason));
  auto driver = std::make_unique<FalconDriver>(std::move(settings), open_port, std::move(port));
  return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority, watchdog);
}

}  // namespace

DeviceKind falcon_device() {
  return {"falcon", "a Novint Falcon: three axes, 8 N; --firmware, --motor-counts", "falcon", open_falcon,
          find_falcons};
}

}  // namespace tandem::devices

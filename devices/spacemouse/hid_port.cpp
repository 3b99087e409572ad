// Connection to a SpaceMouse through hidapi. Its hidraw backend lists devices from sysfs without opening them. Devices
// that the user has no permission to open are therefore listed as well.
#include "devices/spacemouse/hid_port.hpp"

#include <hidapi/hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <string>

namespace tandem::devices {
namespace {

// Vendor ids of 3Dconnexion devices (the second id is Logitech's). Other devices with these ids, such as mice and
// keyboards, are excluded by their HID usage: they are not multi-axis controllers.
constexpr std::array<unsigned short, 2> kVendors{0x256f, 0x046d};
constexpr unsigned short kGenericDesktop = 1, kMultiAxisController = 8;

constexpr std::string_view kNoMouse = "no SpaceMouse is plugged in; plug one in, or use --device sim";
constexpr std::string_view kNoMouseRights =
    "a SpaceMouse is plugged in, but you may not open it; install deploy/udev/70-tandem.rules into /etc/udev/rules.d "
    "and plug it in again";
constexpr std::string_view kMouseBusy =
    "a SpaceMouse is plugged in, but does not open; end other programs that use it, or plug it in again";

struct OpenHidNode {
  std::string path;
  std::string title;
};

std::vector<OpenHidNode> nodes_of(unsigned short vendor) {
  std::vector<OpenHidNode> nodes;
  hid_device_info* const all = hid_enumerate(vendor, 0);
  for (const hid_device_info* one = all; one != nullptr; one = one->next) {
    if (one->usage_page != kGenericDesktop || one->usage != kMultiAxisController) continue;
    std::array<char, 16> id{};
    std::snprintf(id.data(), id.size(), "%04x:%04x", one->vendor_id, one->product_id);
    nodes.push_back({one->path, std::string(id.data()) + " at " + one->path});
  }
  hid_free_enumeration(all);
  return nodes;
}

std::vector<OpenHidNode> space_mouse_nodes() {
  std::vector<OpenHidNode> nodes;
  for (const unsigned short vendor : kVendors) {
    for (OpenHidNode& node : nodes_of(vendor)) nodes.push_back(std::move(node));
  }
  return nodes;
}

bool may_open(const OpenHidNode& node) {
  return access(node.path.c_str(), R_OK | W_OK) == 0;
}

class HidApiPort final : public HidPort {
 public:
  explicit HidApiPort(hid_device* device) : device_(device) {}
  ~HidApiPort() override { hid_close(device_); }
  HidApiPort(const HidApiPort&) = delete;
  HidApiPort& operator=(const HidApiPort&) = delete;

  int read(std::span<std::uint8_t> report, Duration longest) override {
    const auto longest_ms = std::chrono::duration_cast<std::chrono::milliseconds>(longest).count();
    return hid_read_timeout(device_, report.data(), report.size(), static_cast<int>(longest_ms));
  }
  bool write(std::span<const std::uint8_t> report) override {
    return hid_write(device_, report.data(), report.size()) == static_cast<int>(report.size());
  }

 private:
  hid_device* device_;
};

}  // namespace

std::unique_ptr<HidPort> open_space_mouse_port(std::string_view& reason) {
  const std::vector<OpenHidNode> nodes = space_mouse_nodes();
  reason = nodes.empty() ? kNoMouse : kMouseBusy;
  for (const OpenHidNode& node : nodes) {
    if (hid_device* const device = hid_open_path(node.path.c_str())) return std::make_unique<HidApiPort>(device);
    if (!may_open(node)) reason = kNoMouseRights;
  }
  return nullptr;
}

std::vector<FoundDevice> find_space_mice() {
  std::vector<FoundDevice> found;
  for (const OpenHidNode& node : space_mouse_nodes()) {
    found.push_back({node.title, may_open(node) ? std::string() : std::string(kNoMouseRights)});
  }
  return found;
}

}  // namespace tandem::devices

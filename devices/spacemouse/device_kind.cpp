// Registry entry of the device "spacemouse".
#include <stdexcept>

#include "devices/registry.hpp"
#include "devices/spacemouse/space_mouse.hpp"

namespace tandem::devices {
namespace {

CapControl control_of(const std::string& name) {
  if (name == "rate") return CapControl::kRate;
  if (name == "pose") return CapControl::kPose;
  throw std::invalid_argument("--control: \"" + name + "\" does not exist; use one of: rate, pose");
}

std::unique_ptr<Device> open_space_mouse(const DeviceOptions& options) {
  const CapControl control = control_of(options.control);
  std::string_view reason;
  auto port = open_space_mouse_port(reason);
  if (!port) throw std::runtime_error("device spacemouse: " + std::string(reason));
  auto driver = std::make_unique<SpaceMouseDriver>(control, open_space_mouse_port, std::move(port));
  return std::make_unique<ThreadedDevice>(std::move(driver), options.realtime_priority);
}

}  // namespace

// The device displays no force. The profile "sim" is given only because the coupling of the tool is chosen by a
// profile.
DeviceKind spacemouse_device() {
  return {"spacemouse", "a 3Dconnexion SpaceMouse or SpaceNavigator: six axes, no force", "sim", open_space_mouse,
          find_space_mice};
}

}  // namespace tandem::devices

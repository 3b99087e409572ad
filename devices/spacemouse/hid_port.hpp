// The reports of one HID device: the seam between the driver and hidapi, so that a test can stand in for the device.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"
#include "devices/registry.hpp"

namespace tandem::devices {

/// An open device. Closed by its destructor.
class HidPort {
 public:
  virtual ~HidPort() = default;
  /// Out   bytes of the next report, its id first; 0: none came within `longest`; below 0: the device is gone
  virtual int read(std::span<std::uint8_t> report, Duration longest) = 0;
  /// An output report, its id first. False: not delivered.
  virtual bool write(std::span<const std::uint8_t> report) = 0;
};

/// Opens the first device that there is. Null: none; `reason` says why, and what would help.
using OpenHid = std::function<std::unique_ptr<HidPort>(std::string_view& reason)>;

/// By hidapi: the first multi-axis controller (HID usage page 1, usage 8) of 3Dconnexion or of Logitech.
std::unique_ptr<HidPort> open_space_mouse_port(std::string_view& reason);
std::vector<FoundDevice> find_space_mice();

}  // namespace tandem::devices

// Reports of one HID device: the interface between the driver and hidapi, which tests replace by a simulation.
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

/// An open device; the destructor closes it.
class HidPort {
 public:
  virtual ~HidPort() = default;
  /// Receives the next report, waiting at most `longest`. The first byte of a report is its id.
  /// Out     number of bytes; 0: no report arrived; negative: the device is disconnected
  virtual int read(std::span<std::uint8_t> report, Duration longest) = 0;
  /// Sends an output report, whose first byte is its id. Returns false if it was not delivered.
  virtual bool write(std::span<const std::uint8_t> report) = 0;
};

/// Opens the first available device. If there is none, returns null and sets `reason` to cause and remedy.
using OpenHid = std::function<std::unique_ptr<HidPort>(std::string_view& reason)>;

/// Opens the first multi-axis controller (HID usage page 1, usage 8) of 3Dconnexion or Logitech through hidapi.
std::unique_ptr<HidPort> open_space_mouse_port(std::string_view& reason);
std::vector<FoundDevice> find_space_mice();

}  // namespace tandem::devices

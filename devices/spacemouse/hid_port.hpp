// Reports of one HID device: interface between the driver and hidapi, which a test can replace.
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

/// An open device; its destructor closes it.
class HidPort {
 public:
  virtual ~HidPort() = default;
  /// Out     number of bytes of the next report, its id first; 0: none within `longest`; negative: the device is
  ///         disconnected
  virtual int read(std::span<std::uint8_t> report, Duration longest) = 0;
  /// Sends an output report, its id first. False: not delivered.
  virtual bool write(std::span<const std::uint8_t> report) = 0;
};

/// Opens the first available device. Null: none; `reason` has the cause and the remedy.
using OpenHid = std::function<std::unique_ptr<HidPort>(std::string_view& reason)>;

/// Opens, through hidapi, the first multi-axis controller (HID usage page 1, usage 8) of 3Dconnexion or of Logitech.
std::unique_ptr<HidPort> open_space_mouse_port(std::string_view& reason);
std::vector<FoundDevice> find_space_mice();

}  // namespace tandem::devices

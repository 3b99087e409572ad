// Serial connection to a Falcon through its FTDI bridge: the interface between the driver and libusb.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"
#include "devices/registry.hpp"
#include "devices/watchdog.hpp"

namespace tandem::devices {

/// USB vendor requests of the FTDI bridge, and their values.
enum class FtdiRequest : std::uint8_t { kReset = 0, kModem = 1, kFlow = 2, kBaud = 3, kLine = 4, kLatency = 9 };
inline constexpr std::uint16_t kFtdiReset = 0, kFtdiPurgeReceived = 1, kFtdiPurgeToSend = 2;
inline constexpr std::uint16_t kFtdiDtrHigh = 0x0101, kFtdiDtrLow = 0x0100, kFtdiRtsLow = 0x0200;
inline constexpr std::uint16_t kFtdiBaudLoader = 0x4138, kFtdiBaudUpload = 0x0015, kFtdiBaudRun = 0x0002;
inline constexpr std::uint16_t kFtdi8N1 = 0x0008, kFtdiNoFlow = 0;

/// An open connection; the destructor closes it.
class FalconPort {
 public:
  virtual ~FalconPort() = default;
  /// Executes a vendor request. Returns false if it failed.
  virtual bool control(FtdiRequest request, std::uint16_t value) = 0;
  /// Waits until the previous transfer has ended, then starts to send at most 64 bytes. Returns false if nothing can be
  /// sent, e.g. because the device is disconnected.
  virtual bool write(std::span<const std::uint8_t> bytes) = 0;
  /// Returns whether the device has accepted the bytes of the last write().
  virtual bool is_written() const = 0;
  /// Receives bytes, waiting at most `longest` for the first one.
  /// Out     number of bytes, without the bridge's status bytes; 0: none arrived; negative: the device is disconnected
  virtual int read(std::span<std::uint8_t> bytes, Duration longest) = 0;
};

/// Opens the first available device. If there is none, returns null and sets `reason` to cause and remedy.
using OpenFalcon = std::function<std::unique_ptr<FalconPort>(std::string_view& reason)>;

/// Opens a device through libusb. The watchdog, if it is not null, supervises the device until the device is closed.
std::unique_ptr<FalconPort> open_falcon_usb_port(std::string_view& reason, Watchdog* watchdog = nullptr);
/// Returns the command that sets the motors of the opened Falcon to zero, for the watchdog. Returns nothing if this
/// process has not opened a Falcon.
std::optional<ZeroCommand> falcon_zero();
std::vector<FoundDevice> find_falcons();

}  // namespace tandem::devices

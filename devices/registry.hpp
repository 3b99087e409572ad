// The kinds of devices that this program can open, by name. devices/README.md explains how to add a device.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "devices/device.hpp"
#include "devices/device_profile.hpp"
#include "devices/hand_parameters.hpp"
#include "devices/pointer.hpp"
#include "devices/sim/hand_path.hpp"

namespace tandem::devices {

/// Permitted range of DeviceOptions::motor_counts_per_n_m. A value outside is probably a mistake, e.g. in the unit.
inline constexpr double kMinMotorCounts_per_n_m = 100, kMaxMotorCounts_per_n_m = 20'000;

/// Options for opening a device. A member whose comment names a device is used by this device only.
struct DeviceOptions {
  std::string name = "sim";  ///< name of a kind in device_kinds()
  /// Profile with limits, encoder steps and mass. For a simulated hand, this is the device that the hand holds.
  DeviceProfile profile;
  std::string hand = "rest";  ///< simulated hand: name or file of its path, see find_hand_path()
  Duration hand_shift{0};     ///< simulated hand: delay of its path
  /// Simulated hand: parameters of the hand alone, without mass and damping of the device
  HandParameters hand_parameters;
  std::uint64_t seed = 1;        ///< simulated hand: seed of its tremor
  std::filesystem::path motors;  ///< simulated hand: file to which motor commands are written; empty: none
  std::string control = "rate";  ///< spacemouse: whether the cap controls the "rate" or the "pose" of the handle
  /// Falcon: firmware file by the manufacturer; empty: the device already has its firmware
  std::filesystem::path firmware;
  /// Falcon: motor command per N·m. The default is below the values of libnifalcon (10000) and of the manufacturer's
  /// driver (3300 to 7500, depending on the pose), so that the force is too low rather than too high. Calibrate it with
  /// a weight.
  double motor_counts_per_n_m = 3000;
  std::string service = "127.0.0.1:10001";  ///< inverse3: address of the manufacturer's service
  std::string rumble = "auto";         ///< mouse: game pad that displays the force: /dev/input/eventN, "auto" or "off"
  std::filesystem::path library{};     ///< library of a vendor's SDK; empty: searched in the system's library path
  std::shared_ptr<Pointer> pointer{};  ///< mouse: target set by a window; null without a window
  std::shared_ptr<const std::vector<DeviceSample>> recorded{};  ///< replay: recorded samples, at least one
  int realtime_priority = 0;     ///< priority of the device's own thread, if it has one; 0: normal scheduler
  bool is_from_program = false;  ///< true: from a program that embeds the client; false: from the command line

  /// Returns the name of a setting for error messages: "--library" on a command line, else "the setting library".
  std::string setting(const std::string& setting_name) const {
    return (is_from_program ? "the setting " : "--") + setting_name;
  }
};

/// Returns the path of a simulated hand that these options describe.
/// Fails   see find_hand_path()
HandPath hand_path_of(const DeviceOptions& options);

/// A device that was found on this machine.
struct FoundDevice {
  std::string where;    ///< name and port of the device
  std::string problem;  ///< reason why the device cannot be opened, with the remedy; empty: usable
};

/// One kind of device. Its folder in devices/ defines it by a function `DeviceKind NAME_device()`.
struct DeviceKind {
  std::string_view name;         ///< name on the command line
  std::string_view description;  ///< description in one line
  std::string_view profile;      ///< name of the default profile, which gives the limits
  /// Opens the device and returns without waiting. Slow operations such as homing are executed step by step in read().
  /// The state in its samples shows the progress.
  /// Fails   std::invalid_argument or std::runtime_error with the remedy
  std::unique_ptr<Device> (*open)(const DeviceOptions& options);
  /// Finds the connected devices within about 100 ms. Null for a kind without hardware.
  std::vector<FoundDevice> (*find)();
};

const std::vector<DeviceKind>& device_kinds();

/// Returns the kind with this name.
/// Fails   std::invalid_argument: the name is unknown; the message lists the known names. If the name is that of a
///         profile or a profile file, the message explains how a simulated hand can hold such a device
const DeviceKind& find_device_kind(std::string_view name);

/// Returns the name of the device to open for the name "auto": the first real device that can be opened, or "sim" if
/// there is none. If `may_be_real` is false, returns "sim" without a search.
/// In      log  function that receives lines for the user: which device is used, and why each other one is not
std::string choose_device(bool may_be_real, const std::function<void(const std::string&)>& log,
                          const std::vector<DeviceKind>& kinds = device_kinds());

/// Opens the device named `options.name`.
/// Fails   see find_device_kind() and DeviceKind::open
std::unique_ptr<Device> open_device(const DeviceOptions& options);

}  // namespace tandem::devices

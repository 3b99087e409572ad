// The devices that this program can open, by name. devices/README.md explains how to add one.
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

/// Options for opening a device; each device uses those that apply to it.
struct DeviceOptions {
  std::string name = "sim";        ///< name from device_kinds()
  DeviceProfile profile;           ///< limits, encoder and mass: the real device that the simulated hand holds
  std::string hand = "rest";       ///< path of a simulated hand: find_hand_path()
  Duration hand_shift{0};          ///< delay of that path
  HandParameters hand_parameters;  ///< simulated hand, without the device
  std::uint64_t seed = 1;          ///< seed of a simulated hand's tremor
  std::filesystem::path motors;    ///< simulated hand: file that also receives its commands; empty: none
  std::string control = "rate";    ///< spacemouse: effect of the cap, "rate" or "pose"
  std::filesystem::path firmware;  ///< falcon: firmware file of the maker; empty: the device has it already
  /// Falcon: motor counts per N·m. libnifalcon sends 10000, the maker's driver 3300 to 7500 depending on the pose. Our
  /// value is below all of them, so that a force is rather too weak; calibrate with a weight.
  double motor_counts_per_n_m = 3000;
  std::string service = "127.0.0.1:10001";  ///< inverse3: address of the maker's service
  std::string rumble = "auto";              ///< mouse: game pad that displays its force, /dev/input/eventN; or "off"
  std::filesystem::path library{};          ///< library of a vendor's SDK; empty: the system's search path
  std::shared_ptr<Pointer> pointer{};       ///< mouse: target set by a window; null: none
  std::shared_ptr<const std::vector<DeviceSample>> recorded{};  ///< replay: poses of the hand, at least one
  int realtime_priority = 0;  ///< priority of the device's thread, if it has one; 0: normal scheduler
};

/// Path of a simulated hand with these options.
/// Fails   see find_hand_path()
HandPath hand_path_of(const DeviceOptions& options);

/// A device that is plugged in.
struct FoundDevice {
  std::string where;    ///< name and port
  std::string problem;  ///< why it cannot be opened, with the remedy; empty: it can
};

/// One kind of device. A folder of devices/ defines one, by a function `DeviceKind NAME_device()`.
struct DeviceKind {
  std::string_view name;         ///< name on the command line
  std::string_view description;  ///< one line
  std::string_view profile;      ///< default profile for the limits
  /// Returns at once: slow operations such as homing happen during read(), which reports the state.
  /// Fails   std::invalid_argument or std::runtime_error with the remedy
  std::unique_ptr<Device> (*open)(const DeviceOptions& options);
  /// Finds the plugged-in devices within about 100 ms. Null: the device is no hardware.
  std::vector<FoundDevice> (*find)();
};

const std::vector<DeviceKind>& device_kinds();

/// Finds a kind by name.
/// Fails   std::invalid_argument for an unknown name; lists the known names. For the name of a profile or a profile
///         file, it explains how a simulated hand holds such a device
const DeviceKind& find_device_kind(std::string_view name);

/// Resolves "auto": the name of the first real device that can be opened, else "sim". With `may_be_real` false: "sim",
/// without a search.
/// In      log  receives readable lines: the device in use, and why earlier ones are not
std::string choose_device(bool may_be_real, const std::function<void(const std::string&)>& log,
                          const std::vector<DeviceKind>& kinds = device_kinds());

/// Opens the device of `options.name`.
/// Fails   see find_device_kind() and DeviceKind::open
std::unique_ptr<Device> open_device(const DeviceOptions& options);

}  // namespace tandem::devices

// The devices that this program can open, by name. devices/README.md has the recipe for another one.
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

/// What a device is opened with; each takes what concerns it.
struct DeviceOptions {
  std::string name = "sim";        ///< which device, of device_kinds()
  DeviceProfile profile;           ///< limits, encoder and mass: which real device the simulated hand holds
  std::string hand = "rest";       ///< what a simulated hand intends: find_hand_path()
  Duration hand_shift{0};          ///< later than its path says
  HandParameters hand_parameters;  ///< of a simulated hand, without the device
  std::uint64_t seed = 1;          ///< of a simulated hand's tremor
  std::filesystem::path motors;    ///< of a simulated hand: where its commands go as well; empty: nowhere
  std::string control = "rate";    ///< what the cap of a spacemouse does: "rate" or "pose"
  std::filesystem::path firmware;  ///< of a falcon: a file of its maker's; empty: it must be loaded already
  /// Of a falcon. libnifalcon sends 10000, the maker's driver 3300 to 7500 depending on the pose: ours is below all of them,
  /// so that a force is rather too weak; calibrate with a weight.
  double motor_counts_per_n_m = 3000;
  std::string service = "127.0.0.1:10001";  ///< of an inverse3: where its maker's service listens
  std::string rumble = "auto";         ///< of a mouse: a game pad that shows its force, /dev/input/eventN; or "off"
  std::filesystem::path library{};     ///< of a vendor's SDK, as its user has it; empty: where the system finds it
  std::shared_ptr<Pointer> pointer{};  ///< of a window, for a mouse; null: none
  std::shared_ptr<const std::vector<DeviceSample>> recorded{};  ///< of replay: where the hand was, at least once
  int realtime_priority = 0;  ///< of the device's thread, where it has one; 0: normal scheduler
};

/// What a simulated hand of these options intends.
/// Fails   as find_hand_path()
HandPath hand_path_of(const DeviceOptions& options);

/// One that is there.
struct FoundDevice {
  std::string where;    ///< which, and at which port
  std::string problem;  ///< why it cannot be opened, and what would help; empty: it can
};

/// One kind of device. A folder of devices/ defines one, by a function `DeviceKind NAME_device()`.
struct DeviceKind {
  std::string_view name;         ///< as on the command line
  std::string_view description;  ///< one line
  std::string_view profile;      ///< whose limits it has unless another is asked for
  /// Returns at once: what takes time, homing too, happens behind read(), which reports the state meanwhile.
  /// Fails   std::invalid_argument or std::runtime_error, which say what would help
  std::unique_ptr<Device> (*open)(const DeviceOptions& options);
  /// Those that are plugged in: looks at most for some 100 ms. Null: of one that is no thing.
  std::vector<FoundDevice> (*find)();
};

const std::vector<DeviceKind>& device_kinds();

/// Fails   std::invalid_argument for a name that device_kinds() does not have; it names those that exist and, when it
///         is the name of a profile or a file with one, how a simulated hand holds such a device
const DeviceKind& find_device_kind(std::string_view name);

/// What "auto" stands for.
/// Name of the first real device that can be opened, else "sim"; `may_be_real` false: "sim", without a look.
/// In      tell  for people, a line each: which one is used, and why those before it are not
std::string choose_device(bool may_be_real, const std::function<void(const std::string&)>& tell,
                          const std::vector<DeviceKind>& kinds = device_kinds());

/// Fails   as find_device_kind(), and as the device's own open
std::unique_ptr<Device> open_device(const DeviceOptions& options);

}  // namespace tandem::devices

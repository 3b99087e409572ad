// Profiles of haptic devices: one data file, each number with its source (devices/profiles.json).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/haptics/coupling/adaptive.hpp"
#include "devices/device.hpp"
#include "devices/hand_parameters.hpp"

namespace tandem::devices {

/// One kind of device. A maximum with an unverified source never raises a limit (device.hpp, is_verified()).
struct DeviceProfile {
  std::string name;   ///< name on the command line: "omega.6"
  std::string title;  ///< readable name
  DeviceSpec spec;
  std::string limits_source;        ///< source of the spec's own limits and of rate_hz
  Vec3 workspace_m = Vec3::Zero();  ///< width (x), height (y), depth (z) in the base frame
  std::string workspace_source;
  SourcedLimit stiffness_maximum_n_per_m;  ///< largest virtual spring that the device can show
  SourcedLimit stiffness_maximum_n_m_per_rad;
  SourcedLimit damping_maximum_n_s_per_m;  ///< largest virtual damper
  SourcedLimit damping_maximum_n_m_s_per_rad;
  SourcedLimit apparent_mass_kg;  ///< felt at the handle with motors off
  SourcedLimit apparent_inertia_kg_m2;
  SourcedLimit
      physical_damping_n_s_per_m;  ///< damping of the mechanism, which dissipates the energy that sampling creates
  SourcedLimit physical_damping_n_m_s_per_rad;
  SourcedLimit position_step_m;  ///< resolution of the reported position; 0: exact
  SourcedLimit rotation_step_rad;
  double rate_hz = 1000;                         ///< rate of its haptic loop
  std::optional<haptics::AdaptiveFit> adaptive;  ///< result of a calibration
  std::string adaptive_source;                   ///< "tandem-lab calibrate --device omega.6"

  /// Whether the device shows torque.
  bool has_torque() const { return spec.has_torque(); }
};

/// All profiles of a file; devices/PROFILES.md lists the fields.
/// Fails   std::invalid_argument naming file, profile, field, value and remedy
std::vector<DeviceProfile> load_device_profiles(const std::filesystem::path& file);
std::vector<DeviceProfile> parse_device_profiles(std::string_view json, const std::string& origin);
/// Text of a file with these profiles, each value on a line of its own; reading it gives identical values.
std::string device_profiles_text(const std::vector<DeviceProfile>& profiles);

/// The profile file: the environment variable TANDEM_DEVICE_PROFILES, else devices/profiles.json in data_folder().
/// Fails   std::invalid_argument naming the missing file
std::filesystem::path shipped_device_profiles();
/// A profile of that file by name or, when `name` ends in ".json", the only profile of that file.
/// Fails   std::invalid_argument: unknown name (lists the known names), or see load_device_profiles()
DeviceProfile find_device_profile(std::string_view name);

/// Parameters of `hand` holding this device: adds the device's mass, inertia and damping, and uses its encoder steps if
/// they are coarser.
HandParameters holding(const HandParameters& hand, const DeviceProfile& profile);

/// Upper bounds of a coupling on this device, in its own newtons and metres. Unverified stiffness and damping do not
/// count; the values of the softest verified device replace them.
haptics::CouplingParameters coupling_bounds(const DeviceProfile& profile);

}  // namespace tandem::devices

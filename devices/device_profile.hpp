// Profiles of haptic devices, read from a data file (devices/profiles.json) in which each number has a source.
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

/// Properties of a device model. A maximum with an unverified source never raises a limit (is_verified() in
/// device.hpp).
struct DeviceProfile {
  std::string name;   ///< name on the command line, such as "omega.6"
  std::string title;  ///< name for display
  DeviceSpec spec;
  std::string limits_source;        ///< source of the software limits in `spec` and of rate_hz
  Vec3 workspace_m = Vec3::Zero();  ///< width (x), height (y), depth (z) of the workspace [m], in the base frame
  std::string workspace_source;
  SourcedLimit stiffness_maximum_n_per_m;  ///< largest stiffness of a virtual spring that the device can display
  SourcedLimit stiffness_maximum_n_m_per_rad;
  SourcedLimit damping_maximum_n_s_per_m;  ///< largest coefficient of a virtual damper that the device can display
  SourcedLimit damping_maximum_n_m_s_per_rad;
  SourcedLimit apparent_mass_kg;  ///< mass felt at the handle when the motors are off
  SourcedLimit apparent_inertia_kg_m2;
  /// Damping of the mechanism, which dissipates energy that sampling generates
  SourcedLimit physical_damping_n_s_per_m;
  SourcedLimit physical_damping_n_m_s_per_rad;
  SourcedLimit position_step_m;  ///< resolution of the reported position; 0: exact
  SourcedLimit rotation_step_rad;
  double rate_hz = 1000;                         ///< rate of the haptic loop with this device [Hz]
  std::optional<haptics::AdaptiveFit> adaptive;  ///< result of the calibration; empty: not calibrated
  std::string adaptive_source;  ///< method of the calibration, e.g. "tandem-lab calibrate --device omega.6"

  /// Returns whether the device can display torque.
  bool has_torque() const { return spec.has_torque(); }
};

/// Reads all profiles of a file; devices/PROFILES.md describes the fields.
/// Fails   std::invalid_argument: the message names file, profile, field, value and remedy
std::vector<DeviceProfile> load_device_profiles(const std::filesystem::path& file);
std::vector<DeviceProfile> parse_device_profiles(std::string_view json, const std::string& origin);
/// Returns the text of a profile file with these profiles, one value a line. Parsing the text gives identical values.
std::string device_profiles_text(const std::vector<DeviceProfile>& profiles);

/// Returns the path of the profile file: the environment variable TANDEM_DEVICE_PROFILES if it is set, otherwise
/// devices/profiles.json in data_folder().
/// Fails   std::invalid_argument: the file does not exist; the message names it
std::filesystem::path shipped_device_profiles();
/// Returns the profile with this name from the profile file. If `name` ends in ".json", reads that file, which must
/// contain exactly one profile.
/// Fails   std::invalid_argument: the name is unknown (the message lists the known names); see also
///         load_device_profiles()
DeviceProfile find_device_profile(std::string_view name);

/// Returns the parameters of `hand` while it holds this device. Mass, inertia and damping of the device are added to
/// those of the hand. The encoder step is the larger one of `hand` and device.
HandParameters holding(const HandParameters& hand, const DeviceProfile& profile);

/// Returns upper bounds of the coupling for this device, in newtons and metres of the device (before workspace
/// scaling). An unverified stiffness or damping is limited to the value of the softest verified device.
haptics::CouplingParameters coupling_bounds(const DeviceProfile& profile);

}  // namespace tandem::devices

// What the haptic devices of this world are like: one data file, each number with its source (devices/profiles.json).
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
  std::string name;   ///< as on the command line: "omega.6"
  std::string title;  ///< for people
  DeviceSpec spec;
  std::string limits_source;        ///< of the spec's own limits and of rate_hz
  Vec3 workspace_m = Vec3::Zero();  ///< width (x), height (y), depth (z) of its base frame
  std::string workspace_source;
  SourcedLimit stiffness_maximum_n_per_m;  ///< of a virtual spring that it can show
  SourcedLimit stiffness_maximum_n_m_per_rad;
  SourcedLimit damping_maximum_n_s_per_m;  ///< of a virtual damper
  SourcedLimit damping_maximum_n_m_s_per_rad;
  SourcedLimit apparent_mass_kg;  ///< what the hand feels at the handle, motors off
  SourcedLimit apparent_inertia_kg_m2;
  SourcedLimit
      physical_damping_n_s_per_m;  ///< of the mechanism itself: what dissipates the energy that sampling creates
  SourcedLimit physical_damping_n_m_s_per_rad;
  SourcedLimit position_step_m;  ///< resolution of the reported position; 0: exact
  SourcedLimit rotation_step_rad;
  double rate_hz = 1000;                         ///< of its loop
  std::optional<haptics::AdaptiveFit> adaptive;  ///< from a calibration
  std::string adaptive_source;                   ///< "tandem-lab calibrate --device omega.6"

  /// Whether it shows torque.
  bool has_torque() const { return spec.has_torque(); }
};

/// All profiles of a file; devices/README.md lists the fields.
/// Fails   std::invalid_argument naming file, profile, field, value and remedy
std::vector<DeviceProfile> load_device_profiles(const std::filesystem::path& file);
std::vector<DeviceProfile> parse_device_profiles(std::string_view json, const std::string& origin);
/// The text of a file with these profiles, each value on a line of its own; reads back to the last bit.
std::string device_profiles_text(const std::vector<DeviceProfile>& profiles);

/// The shipped file: what the environment variable TANDEM_DEVICE_PROFILES names, else devices/profiles.json of
/// data_folder().
/// Fails   std::invalid_argument naming the place where it is not
std::filesystem::path shipped_device_profiles();
/// A profile of the shipped file by name, or, when `name` ends in ".json", the only profile of that file.
/// Fails   std::invalid_argument: unknown name (lists the known), or as load_device_profiles()
DeviceProfile find_device_profile(std::string_view name);

/// `hand` holding this device: its mass, inertia and damping added, its encoder steps taken over where they are coarser
/// than those that the hand was given.
HandParameters holding(const HandParameters& hand, const DeviceProfile& profile);

/// The most that a coupling may ask of this device, in its own newtons and metres. Stiffness and damping that nobody
/// has verified do not count: then those of the softest verified device do.
haptics::CouplingParameters coupling_bounds(const DeviceProfile& profile);

}  // namespace tandem::devices

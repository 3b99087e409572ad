// Intended path of a simulated hand: way points in time, in the device base frame D.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// The intended pose is `X_DH` at `at`. Between way points it moves by minimum jerk; at each one it is at rest.
struct WayPoint {
  Duration at{0};
  Pose X_DH;
  std::uint32_t buttons = 0;  ///< bits held from this way point on
  std::string phase;          ///< name of the phase that begins here, e.g. "approach", "hold"; "": unchanged
  bool is_relaxed = false;    ///< from here on the hand is passive: its intended pose is its present pose
};

/// One sine of a multisine: amplitude·sin(2π·frequency·t + phase) along an axis, t from the multisine's beginning.
struct SineComponent {
  Vec3 axis = Vec3::UnitX();  ///< unit vector in D
  double frequency_hz = 1;
  double amplitude_m = 0;
  double phase_rad = 0;
};

/// A sum of sines, added to the way points between `from` and `to`, for shaking a held body and for circles at constant
/// speed. It fades in and out by minimum jerk over `fade`, so that position and speed are continuous.
struct Multisine {
  Duration from{0};
  Duration to{0};
  Duration fade{0};
  std::vector<SineComponent> components;  ///< empty: no multisine
};

/// A path with at least one way point, times increasing. It rests before the first and after the last one.
class HandPath {
 public:
  /// Fails   std::invalid_argument: no way point, times not increasing, not finite; a multisine without room to fade
  explicit HandPath(std::vector<WayPoint> points, Multisine multisine = {});

  Pose pose_at(Duration time) const noexcept;
  Twist twist_at(Duration time) const noexcept;
  std::uint32_t buttons_at(Duration time) const noexcept;
  bool is_relaxed_at(Duration time) const noexcept;
  /// Index into phases(), or −1 before the first named phase.
  int phase_at(Duration time) const noexcept;
  const std::vector<std::string>& phases() const { return phases_; }
  const std::vector<WayPoint>& points() const { return points_; }
  const Multisine& multisine() const { return multisine_; }
  Duration length() const;
  /// The same path, later by `later`.
  HandPath shifted(Duration later) const;
  /// The same path, `factor` > 0 times as fast.
  HandPath paced(double factor) const;

 private:
  std::size_t segment_of(Duration time) const noexcept;
  Pose way_pose_at(Duration time) const noexcept;
  Twist way_twist_at(Duration time) const noexcept;
  std::vector<WayPoint> points_;
  Multisine multisine_;
  std::vector<std::string> phases_;
  std::vector<int> phase_of_point_;
};

/// Reads {"points": [{"t_s": 0, "position_m": [x,y,z], "rotation_xyz_deg": [..], "buttons": ["grab"], "relaxed": false,
/// "phase": "hold"}]}. An omitted field keeps the value of the previous point. Optional beside the points: "multisine":
/// {"from_s": 2, "to_s": 6, "fade_s": 0.5, "components": [{"axis": [x,y,z], "frequency_hz": 1, "amplitude_m": 0.01,
/// "phase_rad": 0}]}.
/// Fails   std::invalid_argument naming file, field, value and remedy
HandPath load_hand_path(const std::filesystem::path& file);
HandPath parse_hand_path(std::string_view json, std::string_view origin);

/// Built-in paths by name ("rest", "press-down", "circle", "grab-and-lift", …); see hand_path_names().
/// Fails   std::invalid_argument for an unknown name; lists the known names
HandPath named_hand_path(std::string_view name);
std::vector<std::string_view> hand_path_names();
/// A path by its name, or from a file of that name.
/// Fails   see load_hand_path() and named_hand_path()
HandPath find_hand_path(std::string_view name);

}  // namespace tandem::devices

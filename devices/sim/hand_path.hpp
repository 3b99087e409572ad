// Intended trajectory of a simulated hand, given by way points in the device's base frame D.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::devices {

/// A way point: at the time `at`, the hand is at rest at the pose `X_DH`. Between two way points the hand makes a
/// minimum-jerk movement.
struct WayPoint {
  Duration at{0};
  Pose X_DH;
  std::uint32_t buttons = 0;  ///< bits of Button that are pressed from this way point on
  /// Name of the phase that begins here, e.g. "approach" or "hold"; "": the previous phase continues
  std::string phase;
  bool is_relaxed = false;  ///< true: from here on the hand is passive (its intended pose is its actual pose)
};

/// One sine component of a multisine: amplitude·sin(2π·frequency·t + phase) along an axis. t is the time since the
/// beginning of the multisine.
struct SineComponent {
  Vec3 axis = Vec3::UnitX();  ///< unit vector in D
  double frequency_hz = 1;
  double amplitude_m = 0;
  double phase_rad = 0;
};

/// A sum of sines that is added to the positions of the path between the times `from` and `to`. It is used for shaking
/// a held body, and for circles at constant speed. During the time `fade` at either end, its amplitude changes by
/// minimum jerk, so that position and velocity are continuous.
struct Multisine {
  Duration from{0};
  Duration to{0};
  Duration fade{0};
  std::vector<SineComponent> components;  ///< components of the sum; empty: no multisine
};

/// A path with at least one way point and increasing times. The hand is at rest before the first and after the last way
/// point.
class HandPath {
 public:
  /// Fails   std::invalid_argument: no way point, times that do not increase, a number that is not finite, or a
  ///         multisine that is shorter than its two fades
  explicit HandPath(std::vector<WayPoint> points, Multisine multisine = {});

  Pose pose_at(Duration time) const noexcept;
  Twist twist_at(Duration time) const noexcept;
  std::uint32_t buttons_at(Duration time) const noexcept;
  bool is_relaxed_at(Duration time) const noexcept;
  /// Returns the current phase as an index into phases(); −1 before the first way point with a phase.
  int phase_at(Duration time) const noexcept;
  const std::vector<std::string>& phases() const { return phases_; }
  const std::vector<WayPoint>& points() const { return points_; }
  const Multisine& multisine() const { return multisine_; }
  Duration length() const;
  /// Returns this path delayed by `later`.
  HandPath shifted(Duration later) const;
  /// Returns this path with all speeds multiplied by `factor`, which must be above 0.
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

/// Parses the JSON text of a path; load_hand_path() reads it from a file. Format:
///   {"points": [{"t_s": 0, "position_m": [x,y,z], "rotation_xyz_deg": [..], "buttons": ["grab"], "relaxed": false,
///                "phase": "hold"}],
///    "multisine": {"from_s": 2, "to_s": 6, "fade_s": 0.5,
///                  "components": [{"axis": [x,y,z], "frequency_hz": 1, "amplitude_m": 0.01, "phase_rad": 0}]}}
/// A field that is omitted in a point has the value of the previous point. "multisine" is optional.
/// Fails   std::invalid_argument: the message names file, field, value and remedy
HandPath load_hand_path(const std::filesystem::path& file);
HandPath parse_hand_path(std::string_view json, std::string_view origin);

/// Returns a built-in path by its name ("rest", "press-down", "circle", "grab-and-lift", …); see hand_path_names().
/// Fails   std::invalid_argument: the name is unknown; the message lists the known names
HandPath named_hand_path(std::string_view name);
std::vector<std::string_view> hand_path_names();
/// Returns a built-in path by its name, or reads a path from a file if `name` ends in ".json" or contains "/".
/// Fails   see load_hand_path() and named_hand_path()
HandPath find_hand_path(std::string_view name);

}  // namespace tandem::devices

// Where a simulated hand wants to be: way points in time, in the device base frame D.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/spatial.hpp"
#include "common/time.hpp"

namespace tandem {

/// The hand intends to be at `X_DH` at `at`; between way points it moves by minimum jerk, at rest at each one.
struct WayPoint {
  Duration at{0};
  Pose X_DH;
  std::uint32_t buttons = 0;  ///< held from this way point on
  std::string phase;          ///< name of the stretch that begins here, e.g. "approach", "hold"; "": as before
};

/// A path with at least one way point, times increasing. Before the first and after the last it rests there.
class HandPath {
 public:
  /// Fails   std::invalid_argument: no way point, times not increasing, not finite
  explicit HandPath(std::vector<WayPoint> points);

  Pose pose_at(Duration time) const noexcept;
  Twist twist_at(Duration time) const noexcept;
  std::uint32_t buttons_at(Duration time) const noexcept;
  /// Index into phases(), or −1 before the first named one.
  int phase_at(Duration time) const noexcept;
  const std::vector<std::string>& phases() const { return phases_; }
  Duration length() const { return points_.back().at; }

 private:
  std::size_t segment_of(Duration time) const noexcept;
  std::vector<WayPoint> points_;
  std::vector<std::string> phases_;
  std::vector<int> phase_of_point_;
};

/// Reads {"points": [{"t_s": 0, "position_m": [x,y,z], "rotation_xyz_deg": [..], "buttons": ["grab"], "phase":
/// "hold"}]}. Fields may be left out: the value of the point before holds. Fails   std::invalid_argument naming file,
/// field, value and remedy
HandPath load_hand_path(const std::filesystem::path& file);
HandPath parse_hand_path(std::string_view json, std::string_view origin);

/// Built-in paths by name ("rest", "press-down", "circle", "grab-and-lift", …); see hand_path_names().
/// Fails   std::invalid_argument for an unknown name (lists the known)
HandPath named_hand_path(std::string_view name);
std::vector<std::string_view> hand_path_names();

}  // namespace tandem

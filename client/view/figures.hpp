// Data for the window's plots and figures, collected over the last seconds.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/drawn_scene.hpp"
#include "common/docking/atom_contacts.hpp"

namespace tandem::client {

/// The newest kLength values in a ring buffer; offset() is the index of the oldest.
class Curve {
 public:
  static constexpr std::size_t kLength = 400;

  void add(double value);
  const float* data() const { return values_.data(); }
  int offset() const { return static_cast<int>(next_); }
  double largest() const;
  double newest() const { return values_[(next_ + kLength - 1) % kLength]; }

 private:
  std::array<float, kLength> values_{};
  std::size_t next_ = 0;
};

/// Returns the displayed pose of a body; before the first view, its start pose.
Pose felt_pose(const DrawnScene& scene, const View* view, std::size_t body);

/// Collects the values of the plots and figures.
///
/// Thread  the window's
class Figures {
 public:
  /// Time between two values of a curve, and time span of a complete curve.
  static constexpr Duration kStep{std::chrono::milliseconds(20)};
  static constexpr Duration kSpan = kStep * static_cast<int>(Curve::kLength);

  /// Adds a tick. Call for each tick, in order.
  void add(const TickRecord& record);
  /// Adds a view and the session's figures. Call once a frame.
  void add(const View* view, const ClientIoSnapshot& io, LocalTime now);
  /// Updates the figures of two docked molecules a few times a second, if the scene has exactly two molecules. Call
  /// once a frame.
  void add_molecules(const DrawnScene& scene, const View* view, const ClientIoSnapshot& io, LocalTime now);

  Curve force_n, torque_n_m;          ///< largest displayed value in a step of the curve
  Curve round_trip_ms, state_age_ms;  ///< newest value
  Curve residual_n;                   ///< predicted residual force
  Curve longest_tick_ms;              ///< longest interval between two ticks
  double jitter_ms = 0;  ///< standard deviation of the transit time of the server's updates, over the last 2 s
  double loss_up = 0, loss_down = 0;  ///< fractions of messages that the simulated links lost in the last 2 s

  // Figures of the first and the second molecule of the scene, at their displayed poses.
  bool has_molecules = false;
  std::array<std::size_t, 2> molecules{};  ///< indices of their bodies
  std::size_t contacts = 0;
  docking::AtomPairs hydrogen_bonds;
  std::optional<double> rmsd_angstrom;  ///< deviation from the pose in their files

 private:
  void finish_step();
  void add_link(const ClientIoSnapshot& io, LocalTime now);
  void add_transit(const View& view, LocalTime now);

  TickRecord last_;
  double force_max_ = 0, torque_max_ = 0, tick_max_ms_ = 0;
  LocalTime step_end_{};
  LocalTime next_step_{};
  LocalTime next_count_{};
  Step transit_of_;
  std::vector<std::pair<LocalTime, double>> transits_ms_;
  std::vector<std::pair<LocalTime, LinkTraffic>> traffic_;
};

}  // namespace tandem::client

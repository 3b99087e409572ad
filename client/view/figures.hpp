// Collects the values of the last seconds that the window displays as plots and numbers.
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

/// Ring buffer of the newest kLength values of a plot. offset() is the index of the oldest value.
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

/// Returns the displayed pose of a body, or its start pose if no view was received yet.
Pose felt_pose(const DrawnScene& scene, const View* view, std::size_t body);

/// Collects the values for plots and displayed numbers.
///
/// Thread  the one that runs the window
class Figures {
 public:
  /// kStep: time between two values of a curve. kSpan: time span of a full curve.
  static constexpr Duration kStep{std::chrono::milliseconds(20)};
  static constexpr Duration kSpan = kStep * static_cast<int>(Curve::kLength);

  /// Adds a tick of the haptic loop. Call for each tick, in order.
  void add(const TickRecord& record);
  /// Adds the newest view and the network counters of the session. Call once a frame.
  void add(const View* view, const ClientIoSnapshot& io, LocalTime now);
  /// If the scene has exactly two molecules, updates the values below that describe their docking, at most five times a
  /// second. Call once a frame.
  void add_molecules(const DrawnScene& scene, const View* view, const ClientIoSnapshot& io, LocalTime now);

  Curve force_n, torque_n_m;          ///< largest displayed magnitude within each kStep
  Curve round_trip_ms, state_age_ms;  ///< newest value at the end of each kStep
  Curve residual_n;                   ///< predicted residual force (server minus local model)
  Curve longest_tick_ms;              ///< longest interval between two ticks within each kStep
  double jitter_ms = 0;  ///< standard deviation of the transit time of the server's updates, over the last 2 s
  double loss_up = 0, loss_down = 0;  ///< fractions of messages that the simulated links lost in the last 2 s

  // Values for the first and the second molecule of the scene, at their displayed poses.
  bool has_molecules = false;
  std::array<std::size_t, 2> molecules{};  ///< indices of the bodies of the two molecules
  std::size_t contacts = 0;
  docking::AtomPairs hydrogen_bonds;
  std::optional<double> rmsd_angstrom;  ///< deviation of the second molecule from the reference pose

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

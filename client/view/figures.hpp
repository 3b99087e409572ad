// What a window plots and says in numbers, gathered over the last seconds.
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

/// The newest so many values, oldest first when read with their offset.
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

/// Where a body is felt, or where the scene starts it.
Pose felt_pose(const DrawnScene& scene, const View* view, std::size_t body);

/// Thread  the window's
class Figures {
 public:
  /// Of one value of a curve, and of all that a curve shows.
  static constexpr Duration kStep{std::chrono::milliseconds(20)};
  static constexpr Duration kSpan = kStep * static_cast<int>(Curve::kLength);

  /// Each tick, in order.
  void add(const TickRecord& record);
  /// Once a frame.
  void add(const View* view, const ClientIoSnapshot& io, LocalTime now);
  /// Likewise, in a scene of exactly two molecules: how they are to each other, counted some times a second.
  void add_molecules(const DrawnScene& scene, const View* view, const ClientIoSnapshot& io, LocalTime now);

  Curve force_n, torque_n_m;          ///< largest displayed in a step
  Curve round_trip_ms, state_age_ms;  ///< newest
  Curve residual_n;                   ///< of the prediction
  Curve longest_tick_ms;              ///< longest time from one tick to the next
  double jitter_ms = 0;               ///< standard deviation of the server's updates' way here, of the last 2 s
  double loss_up = 0, loss_down = 0;  ///< shares that the simulated links lost in the last 2 s

  // Of the first and the second molecule of the scene, where they are felt.
  bool has_molecules = false;
  std::array<std::size_t, 2> molecules{};  ///< their bodies, by index
  std::size_t contacts = 0;
  docking::AtomPairs hydrogen_bonds;
  std::optional<double> rmsd_angstrom;  ///< from where their files have them

 private:
  void finish_step();
  void take_link(const ClientIoSnapshot& io, LocalTime now);
  void take_transit(const View& view, LocalTime now);

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

// Statistics of a session, computed tick by tick:
// * for each phase of the hand's path
// * for each silence of the server
// * for the displacement of the watched body
//
// A headless run prints them as part of its JSON at the end (client/app/summary.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/haptics/haptic_core.hpp"

namespace tandem::client {

/// Statistics of speeds, forces and torques over a range of ticks. Forces are those that the device displays, in its
/// frame.
class StretchStatistics {
 public:
  void add(const TickRecord& record);

  std::uint64_t ticks() const { return ticks_; }
  double hand_speed_max_m_per_s() const { return speed_max_; }
  double hand_speed_rms_m_per_s() const;
  double force_mean_n() const { return mean(force_sum_); }
  /// Returns the norm of the mean force vector. If the force oscillates about zero, it is far below force_mean_n().
  double force_mean_vector_n() const;
  double force_max_n() const { return force_max_; }
  double torque_mean_n_m() const { return mean(torque_sum_); }
  double torque_mean_vector_n_m() const;
  double torque_max_n_m() const { return torque_max_; }
  /// Returns the fraction of the ticks in which the user's tool held a body.
  double holding_fraction() const { return mean(static_cast<double>(holding_ticks_)); }

 private:
  double mean(double sum) const { return ticks_ > 0 ? sum / static_cast<double>(ticks_) : 0.0; }

  std::uint64_t ticks_ = 0;
  std::uint64_t hand_ticks_ = 0;  ///< number of ticks with a valid device sample
  std::uint64_t holding_ticks_ = 0;
  double speed_max_ = 0;
  double speed_square_sum_ = 0;
  double force_sum_ = 0;
  double force_max_ = 0;
  double torque_sum_ = 0;
  double torque_max_ = 0;
  Vec3 force_vector_sum_ = Vec3::Zero();
  Vec3 torque_vector_sum_ = Vec3::Zero();
};

struct PhaseReport {
  std::string name;
  Duration duration{0};
  StretchStatistics whole;
  StretchStatistics settled;  ///< statistics of the phase without its first second
};

/// A period without messages from the server, so long that the safety chain must have reduced the force to zero.
struct Silence {
  Duration last_arrival{0};  ///< time of the last arrival before the silence, since the first tick
  /// Time from the last arrival until the force became zero and stayed zero; none if it did not.
  std::optional<Duration> zero_after;
  std::string why;
};

/// Computes the statistics of a run. Ticks are added in the order of time.
///
/// Thread  always the same thread, not the haptic one
class RunReport {
 public:
  /// In      phases        names of the phases of the hand's path
  ///         silence_zero  minimum length of a silence that is reported
  RunReport(const std::vector<std::string>& phases, Duration silence_zero);

  /// In      phase  index into the names of the phases; −1 for none
  void add(const TickRecord& record, int phase);
  bool is_silent() const { return is_silent_; }
  /// Sets the reason of the current silence. Only the first call during a silence has an effect.
  void explain_silence(const std::string& why);

  /// Returns a description of the device's sample (describe()) if the device's state has changed since the last report,
  /// otherwise an empty string. If only validity or reason has changed, a report is made at most once a second, so that
  /// a loose contact does not flood the terminal.
  std::string pop_device_news();

  const std::vector<PhaseReport>& phases() const { return phases_; }
  const std::vector<Silence>& silences() const { return silences_; }
  std::uint32_t server_tick_faults_seen() const { return server_tick_faults_seen_; }
  bool has_seen_body() const { return has_seen_body_; }
  /// Returns the largest distance of the watched body from its first position.
  double body_displacement_m() const { return body_displacement_m_; }
  double body_rotation_rad() const { return body_rotation_rad_; }
  Duration length() const { return newest_ - start_; }

 private:
  void add_to_phase(const TickRecord& record, int phase, Duration step);
  void follow_silence(const TickRecord& record);
  void follow_body(const TickRecord& record);

  std::vector<PhaseReport> phases_;
  Duration silence_zero_;
  bool has_started_ = false;
  LocalTime start_{};
  LocalTime newest_{};
  int phase_ = -1;
  LocalTime phase_entered_{};
  bool is_silent_ = false;
  std::optional<LocalTime> zero_since_;
  std::vector<Silence> silences_;
  devices::DeviceSample sample_;
  devices::DeviceSample reported_;  ///< device sample in the last report
  std::optional<LocalTime> reported_at_;
  std::uint32_t server_tick_faults_seen_ = 0;
  bool has_seen_body_ = false;
  Pose first_body_pose_;
  double body_displacement_m_ = 0;
  double body_rotation_rad_ = 0;
};

}  // namespace tandem::client

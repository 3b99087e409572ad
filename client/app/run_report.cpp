// See run_report.hpp.
#include "client/app/run_report.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

constexpr Duration kSettling{std::chrono::seconds(1)};
constexpr Duration kDeviceNews{std::chrono::seconds(1)};

}  // namespace

void StretchStatistics::add(const TickRecord& record) {
  ++ticks_;
  if (record.held_body.is_valid()) ++holding_ticks_;
  if (record.sample.is_valid) {
    ++hand_ticks_;
    const double speed = record.sample.V_DH.v.norm();
    speed_max_ = std::max(speed_max_, speed);
    speed_square_sum_ += speed * speed;
  }
  const Wrench& displayed = record.displayed_on_hand_D;
  force_sum_ += displayed.f.norm();
  force_max_ = std::max(force_max_, displayed.f.norm());
  torque_sum_ += displayed.t.norm();
  torque_max_ = std::max(torque_max_, displayed.t.norm());
  force_vector_sum_ += displayed.f;
  torque_vector_sum_ += displayed.t;
}

double StretchStatistics::hand_speed_rms_m_per_s() const {
  return hand_ticks_ > 0 ? std::sqrt(speed_square_sum_ / static_cast<double>(hand_ticks_)) : 0.0;
}

double StretchStatistics::force_mean_vector_n() const {
  return mean(force_vector_sum_.norm());
}

double StretchStatistics::torque_mean_vector_n_m() const {
  return mean(torque_vector_sum_.norm());
}

RunReport::RunReport(const std::vector<std::string>& phases, Duration silence_zero) : silence_zero_(silence_zero) {
  reported_.state = devices::DeviceState::kReady;  // state that needs no report
  reported_.is_valid = true;
  for (const std::string& name : phases) phases_.push_back({name, Duration{0}, {}, {}});
}

void RunReport::add(const TickRecord& record, int phase) {
  if (!has_started_) start_ = newest_ = record.at;
  has_started_ = true;
  add_to_phase(record, phase, record.at - newest_);
  newest_ = record.at;
  sample_ = record.sample;
  server_tick_faults_seen_ |= record.server_tick_faults;
  follow_silence(record);
  follow_body(record);
}

std::string RunReport::pop_device_news() {
  const bool is_same = sample_.is_valid == reported_.is_valid && sample_.reason == reported_.reason;
  if (sample_.state == reported_.state && (is_same || (reported_at_ && newest_ - *reported_at_ < kDeviceNews)))
    return {};
  reported_ = sample_;
  reported_at_ = newest_;
  return describe(sample_);
}

void RunReport::explain_silence(const std::string& why) {
  if (is_silent_ && silences_.back().why.empty()) silences_.back().why = why;
}

void RunReport::add_to_phase(const TickRecord& record, int phase, Duration step) {
  const bool is_entered = phase != phase_;
  phase_ = phase;
  if (is_entered) phase_entered_ = record.at;
  if (phase < 0 || static_cast<std::size_t>(phase) >= phases_.size()) return;
  PhaseReport& report = phases_[static_cast<std::size_t>(phase)];
  if (!is_entered) report.duration += step;
  report.whole.add(record);
  if (record.at - phase_entered_ >= kSettling) report.settled.add(record);
}

void RunReport::follow_silence(const TickRecord& record) {
  const Wrench& displayed = record.displayed_on_hand_D;
  const bool is_zero = displayed.f.isZero(0) && displayed.t.isZero(0);
  if (!is_zero) zero_since_.reset();
  if (is_zero && !zero_since_) zero_since_ = record.at;

  const bool was_silent = is_silent_;
  is_silent_ = record.state_age >= silence_zero_;
  if (!is_silent_) return;
  const LocalTime last_arrival = record.at - record.state_age;
  if (!was_silent) silences_.push_back({last_arrival - start_, std::nullopt, ""});
  Silence& silence = silences_.back();
  if (zero_since_ && !silence.zero_after) silence.zero_after = std::max(Duration{0}, *zero_since_ - last_arrival);
}

void RunReport::follow_body(const TickRecord& record) {
  if (!record.watched_body_W) return;
  const Pose& X_WB = record.watched_body_W->X;
  if (!has_seen_body_) first_body_pose_ = X_WB;
  has_seen_body_ = true;
  body_displacement_m_ = std::max(body_displacement_m_, (X_WB.p - first_body_pose_.p).norm());
  const Quat turn = X_WB.q * first_body_pose_.q.conjugate();
  body_rotation_rad_ = std::max(body_rotation_rad_, rotation_vector(turn).norm());
}

}  // namespace tandem::client

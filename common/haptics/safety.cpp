// See safety.hpp. The start ramp, periods without server states (silences) and faults share a single gain. No sequence
// of them can therefore cause a step of force.
#include "common/haptics/safety.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace tandem::haptics {
namespace {

// A wrench above this limit is treated like NaN. The limit is 1e5 times that of any device. Sums of such wrenches do
// not overflow.
constexpr double kAbsurdWrench = 1e6;
// A handle counts as driven by the displayed force if it moves faster than kDriven_m_per_s along a force of kDriving_n
// or more. A body that a user carries or shakes moves along its force at 0.5 m/s at most (our estimate). A device of
// 0.15 kg that nobody holds reaches 1 m/s within 15 mm under a force of 5 N.
constexpr double kDriving_n = 1, kDriven_m_per_s = 1;
// Time constants of the transition when a new state ends a silence. They avoid jumps of the force and of its slope:
// * kFallEnds_s: the gain does not stop falling at once; the rate of its fall decays with this time constant.
// * kShownAgain_s: a rise of the wrench during that fall is displayed later, with this time constant.
constexpr double kFallEnds_s = 0.006;
constexpr double kShownAgain_s = 0.020;
constexpr double kSteepestFall_per_s = 60;
// Limits that apply for the time kReturns_s after a silence, because the first new states may differ much from the last
// one. They also apply after a gap that was up to kAlmost shorter than a silence.
// * kReturn_n_per_s, kSteepestFall_n_per_s: rise of the force, and fall of a strong force. Both are below 0.3 N/ms, a
//   change that users perceive as a step.
// * kRelease_s: duration of the decay if the computed force has vanished during the silence.
constexpr double kReturns_s = 0.5, kReturn_n_per_s = 280, kSteepestFall_n_per_s = 250, kRelease_s = 0.015;
constexpr Duration kAlmost{std::chrono::milliseconds(15)};
// Rate at which the force falls when the clutch is pressed. Users do not perceive 0.1 N/ms as a step. The torque falls
// at a similar rate.
constexpr double kClutchFall_n_per_s = 100, kClutchFall_n_m_per_s = 5;
constexpr Duration kSilencePromise{std::chrono::milliseconds(150)};
constexpr Duration kFaultPromise{std::chrono::milliseconds(20)};

constexpr std::array<std::string_view, 11> kFaultNames{"ramping",  "silence",        "slewed",   "not_finite",
                                                       "too_fast", "invalid_sample", "stopping", "not_displaying",
                                                       "clutched", "late",           "slow"};

void require(bool is_good, const char* field, double value, const char* remedy) {
  if (is_good) return;
  throw std::invalid_argument(std::string("safety setting ") + field + " is " + std::to_string(value) + "; " + remedy);
}

void check(const SafetySettings& s) {
  require(s.start_ramp > Duration{0}, "start_ramp [s]", to_seconds(s.start_ramp), "it must be above 0");
  require(s.silence_start >= Duration{0}, "silence_start [s]", to_seconds(s.silence_start), "it must be 0 or more");
  require(s.silence_zero > s.silence_start && s.silence_zero <= kSilencePromise, "silence_zero [s]",
          to_seconds(s.silence_zero), "it must be above silence_start and at most 0.15");
  require(s.fault_decay > Duration{0} && s.fault_decay <= kFaultPromise, "fault_decay [s]", to_seconds(s.fault_decay),
          "it must be above 0 and at most 0.02");
  require(s.late_tick > Duration{0} && s.late_tick <= kFaultPromise, "late_tick [s]", to_seconds(s.late_tick),
          "it must be above 0 and at most 0.02");
  require(s.tick > Duration{0}, "tick [s]", to_seconds(s.tick), "it must be above 0");
  require(std::isfinite(s.slew_n_per_s) && s.slew_n_per_s > 0, "slew_n_per_s", s.slew_n_per_s, "it must be above 0");
  require(std::isfinite(s.slew_n_m_per_s) && s.slew_n_m_per_s > 0, "slew_n_m_per_s", s.slew_n_m_per_s,
          "it must be above 0");
  require(std::isfinite(s.speed_limit_m_per_s) && s.speed_limit_m_per_s > 0, "speed_limit_m_per_s",
          s.speed_limit_m_per_s, "it must be above 0");
}

/// Returns |part| / |whole|, clamped to 1.
double length_share(const Vec3& part, const Vec3& whole) {
  const double length = whole.norm();
  return length > 0 ? std::min(1.0, part.norm() / length) : 1.0;
}

bool is_plausible(const Wrench& wrench) {
  return is_finite(wrench) && wrench.f.cwiseAbs().maxCoeff() < kAbsurdWrench &&
         wrench.t.cwiseAbs().maxCoeff() < kAbsurdWrench;
}

/// Returns true if the handle moves along the displayed force faster than kDriven_m_per_s. We assume that a hand which
/// holds the handle reaches this speed only in other directions.
bool is_driven_off(const Vec3& handle_v, const Vec3& force_on_hand) {
  const double force_n = force_on_hand.norm();
  return force_n >= kDriving_n && handle_v.dot(force_on_hand) > kDriven_m_per_s * force_n;
}

/// Returns `share` after the time `rise_s`, in which it approaches 1 exponentially.
double risen(double share, double rise_s) {
  return 1 - (1 - share) * std::exp(-rise_s / kShownAgain_s);
}

}  // namespace

std::vector<std::string> safety_fault_names(SafetyFaults faults) {
  std::vector<std::string> names;
  for (std::size_t bit = 0; bit < kFaultNames.size(); ++bit) {
    if ((faults & (1U << bit)) != 0) names.emplace_back(kFaultNames[bit]);
  }
  return names;
}

std::string describe_safety_faults(SafetyFaults faults) {
  std::string text;
  for (const std::string& name : safety_fault_names(faults)) text += (text.empty() ? "" : "|") + name;
  return text.empty() ? "none" : text;
}

SafetyChain::SafetyChain(const SafetySettings& settings)
    : settings_((check(settings), settings)), rate_(settings.tick) {}

Wrench SafetyChain::apply(LocalTime now, const SafetyInput& input) noexcept {
  const double since_s = advance_time(now);
  // The ramp and the slew limit advance by at most one period per tick. A late tick counts as exactly one period.
  const double period_s = to_seconds(settings_.tick);
  const bool is_late = since_s > period_s + to_seconds(settings_.late_tick);
  const double elapsed_s = is_late ? period_s : since_s;
  const double rise_s = std::min(elapsed_s, period_s);
  const bool is_slow = rate_.is_slow(now) || input.is_room_slow;
  faults_ =
      present_faults(input) | (is_late ? SafetyFaults{kSafetyLate} : 0) | (is_slow ? SafetyFaults{kSafetySlow} : 0);
  latched_ |= faults_;
  const double gain_before = gain_;
  update_gain(input, elapsed_s, rise_s);

  const double share = gain_ < gain_before ? gain_ / gain_before : 1.0;
  // While a clutch press is latched, the computed wrench is ignored, even if the clutch was released meanwhile.
  // Pressing and releasing let the handle's speed jump, and with it the damper force.
  const bool is_clutched = (latched_ & kSafetyClutched) != 0;
  const bool is_usable =
      input.has_state && input.is_displaying && !is_clutched && input.sample_is_valid && is_plausible(input.wrench);
  if (!is_usable) shown_force_ = shown_torque_ = 1;
  shown_force_ = risen(shown_force_, rise_s);
  shown_torque_ = risen(shown_torque_, rise_s);
  const Wrench target{input.wrench.f * (gain_ * shown_force_), input.wrench.t * (gain_ * shown_torque_)};
  // Without a usable wrench, the last displayed wrench is scaled with the gain. The output thus falls without a step,
  // and is zero when the gain is zero.
  Wrench out = is_usable ? slewed(target, rise_s) : displayed_ * share;
  if (share < 1) {
    out.f = clamped_to_length(out.f, displayed_.f.norm() * share);
    out.t = clamped_to_length(out.t, displayed_.t.norm() * share);
    if (is_usable) {
      shown_force_ = length_share(out.f, input.wrench.f * gain_);
      shown_torque_ = length_share(out.t, input.wrench.t * gain_);
    }
  }
  if (gain_ <= 0 || !is_finite(out)) {
    out = Wrench{};
    shown_force_ = shown_torque_ = 1;
  }
  displayed_ = out;
  return out;
}

bool SafetyChain::is_quiet() const noexcept {
  return gain_ <= 0 && displayed_.f.isZero(0) && displayed_.t.isZero(0);
}

double SafetyChain::advance_time(LocalTime now) noexcept {
  const double elapsed_s = has_time_ ? std::max(0.0, to_seconds(now - last_time_)) : 0.0;
  last_time_ = has_time_ ? std::max(now, last_time_) : now;
  has_time_ = true;
  return elapsed_s;
}

SafetyFaults SafetyChain::present_faults(const SafetyInput& input) const noexcept {
  SafetyFaults faults = 0;
  if (!is_plausible(input.wrench)) faults |= kSafetyNotFinite;
  // The comparison is negated so that a NaN speed also counts as too fast.
  if (!(input.handle_speed_m_per_s <= settings_.speed_limit_m_per_s)) faults |= kSafetyTooFast;
  if (is_driven_off(input.handle_v, displayed_.f)) faults |= kSafetyTooFast;
  if (!input.sample_is_valid) faults |= kSafetyInvalidSample;
  if (input.is_clutched) faults |= kSafetyClutched;
  if (is_stopping_) faults |= kSafetyStopping;
  return faults;
}

void SafetyChain::update_gain(const SafetyInput& input, double elapsed_s, double rise_s) noexcept {
  const double gain_before = gain_;
  const double silence = silence_gain(input.state_age);
  // A fault stays latched until the device has displayed zero. If the fault ends earlier, the decay nevertheless
  // continues to zero.
  if (is_quiet() && faults_ == 0) latched_ = 0;
  if (latched_ != 0 || !input.has_state || !input.is_displaying) {
    gain_ = std::max(0.0, gain_ - release_step(input, elapsed_s));
  } else {
    const double steepest_per_s = gain_ * kSteepestFall_n_per_s / std::max(displayed_.f.norm(), 1e-3);
    const double fall_per_s = silence < 1 ? 0 : std::min(fall_per_s_, steepest_per_s);
    gain_ = std::clamp(gain_ + rise_s * (1 / to_seconds(settings_.start_ramp) - fall_per_s), 0.0, 1.0);
  }
  const bool is_gap = input.state_age > settings_.silence_start - kAlmost;
  returning_s_ = is_gap ? kReturns_s : std::max(0.0, returning_s_ - elapsed_s);
  if (is_gap) silent_force_n_ = displayed_.f.norm();
  fall_per_s_ *= std::exp(-elapsed_s / kFallEnds_s);
  // Lower bound of the gain in this tick. In a silence the gain usually falls more slowly. After a stall of the loop,
  // the silence gain may be 0 at once; the bound then spreads the fall over several ticks.
  const double least = gain_before - elapsed_s / to_seconds(settings_.fault_decay);
  gain_ = std::max(std::min(gain_, silence), least);
  if (gain_ <= 0) {
    fall_per_s_ = 0;
  } else if (silence < 1 && elapsed_s > 0) {
    fall_per_s_ = std::clamp((gain_before - gain_) / elapsed_s, 0.0, kSteepestFall_per_s);
  }
  faults_ |= latched_;
  // While no force is to be displayed, only a state that is too old counts as silence; a missing state does not.
  const bool is_silent = (input.is_displaying && !input.has_state) || silence < 1;
  if (is_silent) faults_ |= kSafetySilence;
  if (!input.is_displaying) faults_ |= kSafetyNotDisplaying;
  if (gain_ < 1 && latched_ == 0 && !is_silent && input.is_displaying) faults_ |= kSafetyRamping;
}

// Returns the decrease of the gain in a tick. A pressed clutch is not a fault: the force then decays more slowly than
// after a fault, so that the user feels no step.
double SafetyChain::release_step(const SafetyInput& input, double elapsed_s) const noexcept {
  const double most = elapsed_s / to_seconds(settings_.fault_decay);
  const bool is_gentle = latched_ == kSafetyClutched && input.has_state && input.is_displaying;
  if (!is_gentle) return most;
  const double force_s = displayed_.f.norm() / kClutchFall_n_per_s;
  const double torque_s = displayed_.t.norm() / kClutchFall_n_m_per_s;
  const double length_s = std::max(force_s, torque_s);  // duration of the fall to zero from the displayed wrench
  return length_s > 0 ? std::min(most, gain_ * elapsed_s / length_s) : most;
}

double SafetyChain::silence_gain(Duration state_age) const noexcept {
  const double left_s = to_seconds(settings_.silence_zero - state_age);
  const double left = std::clamp(left_s / to_seconds(settings_.silence_zero - settings_.silence_start), 0.0, 1.0);
  // This polynomial has zero slope at both ends, so that the user hardly feels the first milliseconds of a silence.
  return left * left * left * (10 - 15 * left + 6 * left * left);
}

Wrench SafetyChain::slewed(const Wrench& target, double rise_s) noexcept {
  const Wrench change = target - displayed_;
  const bool grows = target.f.norm() >= displayed_.f.norm();
  const double return_n_per_s = grows ? kReturn_n_per_s : std::max(kReturn_n_per_s, silent_force_n_ / kRelease_s);
  const double slower = returning_s_ > 0 ? std::min(1.0, return_n_per_s / settings_.slew_n_per_s) : 1.0;
  const double largest_f = slower * settings_.slew_n_per_s * rise_s;
  const double largest_t = slower * settings_.slew_n_m_per_s * rise_s;
  if (change.f.norm() <= largest_f && change.t.norm() <= largest_t) return target;
  faults_ |= kSafetySlewed;
  return displayed_ + Wrench{clamped_to_length(change.f, largest_f), clamped_to_length(change.t, largest_t)};
}

}  // namespace tandem::haptics

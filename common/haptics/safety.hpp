// Safety stages between a computed force and a hand, in a fixed order: ramp and decay, slew limit, check for finite
// values. The clamp in devices/device_writer.hpp is the last stage. No stage increases a force or its rate.
//
//   gain   1 ┤          ________                 ______      rises only with the start ramp, falls in a
//            │        ／        ＼             ／            silence (115 → 148 ms) or after a fault (15 ms)
//          0 ┤______／            ＼__________／
//               start        silence      state again
//
// The deadline for zero force takes precedence over the slew limit: while the gain falls, the output falls at least in
// proportion to the gain. If the gain is zero, the output is exactly zero.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/realtime/rate_watch.hpp"

namespace tandem::haptics {

/// Reasons why the displayed force differs from the computed one. The text after a colon is the effect on the displayed
/// force.
enum SafetyFault : std::uint32_t {
  kSafetyRamping = 1U << 0U,    ///< start ramp, at the start or after silence or a fault
  kSafetySilence = 1U << 1U,    ///< no server state, or none for longer than silence_start: force decaying or zero
  kSafetySlewed = 1U << 2U,     ///< the change was limited by the slew rate
  kSafetyNotFinite = 1U << 3U,  ///< the computed wrench was NaN, infinite or implausibly large: zero, then start ramp
  kSafetyTooFast = 1U << 4U,    ///< handle too fast, or driven by the force: zero within 20 ms, then start ramp
  kSafetyInvalidSample = 1U << 5U,  ///< the hand's pose is lost or implausible: zero within 20 ms, then start ramp
  kSafetyStopping = 1U << 6U,       ///< the program shuts down
  kSafetyNotDisplaying = 1U << 7U,  ///< no force is to be displayed: an observer, or no session
  kSafetyClutched = 1U << 8U,       ///< the clutch is pressed: to zero by at most 0.1 N/ms, start ramp after release
  kSafetyLate = 1U << 9U,           ///< a tick came too late: zero within 20 ticks, then start ramp
  kSafetySlow = 1U << 10U,          ///< loop or server's room below 90 % of its rate: zero, then start ramp
};
using SafetyFaults = std::uint32_t;
/// Returns one name per set bit, in bit order: "ramping", "silence", …
std::vector<std::string> safety_fault_names(SafetyFaults faults);
/// Returns the names joined by "|", such as "ramping|slewed"; "none" for 0.
std::string describe_safety_faults(SafetyFaults faults);

struct SafetySettings {
  Duration start_ramp{from_seconds(0.5)};       ///< time from 0 to full force, at each start of the ramp
  Duration silence_start{from_seconds(0.115)};  ///< time since the last received state up to which the force is full
  Duration silence_zero{from_seconds(0.148)};   ///< time from which the force is zero (guaranteed: zero within 150 ms)
  Duration fault_decay{from_seconds(0.015)};    ///< decay time to zero after a fault (guaranteed: within 20 ms)
  Duration late_tick{from_seconds(0.020)};      ///< delay beyond which a tick counts as a fault
  Duration tick{from_seconds(0.001)};           ///< period of the loop
  double slew_n_per_s = 4000.0;                 ///< slew limits; set from DeviceSpec
  double slew_n_m_per_s = 200.0;
  double speed_limit_m_per_s = 3.0;
};

/// Inputs of the safety chain.
struct SafetyInput {
  Wrench wrench;              ///< computed wrench on the hand
  Duration state_age{0};      ///< time since the last state was received from the server
  bool has_state = false;     ///< whether a state was received in this session
  bool is_displaying = true;  ///< false for an observer or before joining: zero force, even if states arrive
  /// Whether the clutch is pressed. The handle then rests in the world while the hand moves. A force computed from the
  /// resting handle would do work along the hand's motion, and could create energy without limit.
  bool is_clutched = false;
  bool sample_is_valid = true;
  double handle_speed_m_per_s = 0;
  Vec3 handle_v = Vec3::Zero();  ///< velocity of the handle [m/s], in the wrench's frame
  bool is_room_slow = false;     ///< flag kFaultRoomSlow received from the server
};

/// Safety stages before the clamp. apply() is called once a tick.
///
/// Model   Rise: the gain g rises by dt / start_ramp in a tick of the duration dt. g is at most the silence gain, a
///         smooth function of the state's age that falls from 1 to 0. After a silence g rises smoothly, too.
///         Fall: after a fault, or while there is no state or nothing is displayed, g falls by dt / fault_decay. After
///         a fault g must reach 0 before it may rise again. If the clutch is the only reason for a fall, the wrench
///         falls no faster than 100 N/s and 5 N·m/s.
///         Driven handle: a handle that moves faster than 1 m/s along a displayed force of 1 N or more is a fault. The
///         force then drives a handle that no hand holds.
///         Output: out = slew(g · wrench). While g falls, |out| ≤ |displayed before| · g / g_before, separately for
///         force and torque. Once g stops falling, the part removed by this bound returns within 60 ms. If there is no
///         usable wrench (no state, no sample, not finite, clutched), out is the displayed wrench times g / g_before.
///         The decay after a fault ends when zero has been displayed, not when it has been computed.
///         Stalls: while the loop does not run (a stopped process, a suspended machine), the device holds the last
///         force. A late tick is therefore a fault. The force then decays in steps from its held value, whatever the
///         new wrench and the age of the state; each step is that of one period.
///         Return after a silence: for 0.5 s the force changes by at most 0.28 N/ms, and the torque by the same
///         fraction of its slew limit. A falling gain reduces the force by at most 0.25 N/ms, but a decrease to zero
///         still takes at most 15 ms. These limits also apply after a gap that is up to 15 ms shorter than a silence.
/// Thread  haptic: no allocation, no throw
class SafetyChain {
 public:
  /// Fails   throws std::invalid_argument for settings that cannot meet the guaranteed times (names field, value and
  ///         remedy)
  explicit SafetyChain(const SafetySettings& settings);
  /// Returns the wrench for the device writer. It is always finite.
  Wrench apply(LocalTime now, const SafetyInput& input) noexcept;
  /// Sets the wrench that was displayed after the clamp; without this call, it is the result of apply(). The slew limit
  /// counts from this wrench. Otherwise the output could grow far beyond a clamped force (wind-up).
  void set_displayed(const Wrench& wrench) noexcept { displayed_ = wrench; }
  /// Lets the force decay to zero over fault_decay, then starts the ramp again.
  void rearm() noexcept { latched_ |= kSafetyRamping; }
  /// Lets the force decay to zero over fault_decay; it then remains zero.
  void begin_shutdown() noexcept { is_stopping_ = true; }
  /// Returns true if zero is displayed and the output stays zero until the gain rises.
  bool is_quiet() const noexcept;
  SafetyFaults faults() const noexcept { return faults_; }

 private:
  double advance_time(LocalTime now) noexcept;
  SafetyFaults present_faults(const SafetyInput& input) const noexcept;
  void update_gain(const SafetyInput& input, double elapsed_s, double rise_s) noexcept;
  double release_step(const SafetyInput& input, double elapsed_s) const noexcept;
  double silence_gain(Duration state_age) const noexcept;
  Wrench slewed(const Wrench& target, double rise_s) noexcept;

  SafetySettings settings_;
  realtime::RateWatch rate_;
  LocalTime last_time_{};
  bool has_time_ = false;
  double gain_ = 0.0;
  double fall_per_s_ = 0.0;   ///< rate at which the gain falls in a silence [1/s]; decays after the end of the silence
  double returning_s_ = 0.0;  ///< remaining time after a silence during which the force may change only slowly
  double silent_force_n_ = 0.0;  ///< force displayed when the silence ended
  Wrench displayed_;
  /// Fraction of (gain times wrench) that is displayed, for force and torque. It falls below 1 if the gain falls while
  /// the wrench rises. When the gain stops falling, the fraction returns to 1.
  double shown_force_ = 1;
  double shown_torque_ = 1;
  SafetyFaults latched_ = 0;  ///< faults whose decay has not reached zero yet
  bool is_stopping_ = false;
  SafetyFaults faults_ = 0;
};

}  // namespace tandem::haptics

// Safety stages between a computed force and a hand, in fixed order: ramp and decay, slew limit, finite check. The
// clamp is the last stage, in devices/device_writer.hpp. No stage makes a force larger or faster.
//
//   gain   1 ┤          ________                 ______      rises with the start ramp only, falls with
//            │        ／        ＼             ／            silence (115 → 148 ms) or a fault (15 ms)
//          0 ┤______／            ＼__________／
//               start        silence      state again
//
// The deadline for zero force takes precedence over the slew limit: while the gain falls, the output falls at least in
// the same proportion. The output is exactly zero when the gain is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"
#include "common/realtime/rate_watch.hpp"

namespace tandem::haptics {

/// Why the displayed force differs from the computed one.
enum SafetyFault : std::uint32_t {
  kSafetyRamping = 1U << 0U,    ///< start ramp, or re-arming after silence or a fault
  kSafetySilence = 1U << 1U,    ///< no server state, or none for longer than silence_start: decaying or zero
  kSafetySlewed = 1U << 2U,     ///< the change was limited by the slew rate
  kSafetyNotFinite = 1U << 3U,  ///< the computed wrench was NaN, infinite or absurd: zero, then re-armed by the ramp
  kSafetyTooFast = 1U << 4U,    ///< handle faster than the device's limit, or driven off: zero within 20 ms, re-armed
  kSafetyInvalidSample = 1U << 5U,  ///< the hand's pose was lost or is implausible: zero within 20 ms, then re-armed
  kSafetyStopping = 1U << 6U,       ///< shutting down
  kSafetyNotDisplaying = 1U << 7U,  ///< no force is to be displayed: an observer, or no session
  kSafetyClutched = 1U << 8U,       ///< the clutch is pressed: to zero by 0.1 N/ms at most, ramped in after release
  kSafetyLate = 1U << 9U,           ///< a tick came too late: zero within 20 ticks, then re-armed by the ramp
  kSafetySlow = 1U << 10U,          ///< the loop or the server's room runs below 90 % of its rate: zero, then re-armed
};
using SafetyFaults = std::uint32_t;
/// Returns one word per set bit, in bit order: "ramping", "silence", …
std::vector<std::string> safety_fault_names(SafetyFaults faults);
/// Returns the names joined, e.g. "ramping|slewed"; "none" for 0.
std::string describe_safety_faults(SafetyFaults faults);

struct SafetySettings {
  Duration start_ramp{
      from_seconds(0.5)};  ///< time from 0 to full force after start, a new connection, silence or a fault
  Duration silence_start{from_seconds(0.115)};  ///< time since the last arrival up to which the force is full …
  Duration silence_zero{from_seconds(0.148)};   ///< … and from which it is zero (promise: zero within 150 ms)
  Duration fault_decay{from_seconds(0.015)};    ///< decay time to zero after a fault (promise: within 20 ms)
  Duration late_tick{from_seconds(0.020)};      ///< delay of a tick beyond which it is a fault
  Duration tick{from_seconds(0.001)};           ///< period of the loop
  double slew_n_per_s = 4000.0;                 ///< set from DeviceSpec
  double slew_n_m_per_s = 200.0;
  double speed_limit_m_per_s = 3.0;
};

/// Inputs of the safety chain, including the wrench.
struct SafetyInput {
  Wrench wrench;              ///< computed, on the hand
  Duration state_age{0};      ///< time since the last arrival from the server
  bool has_state = false;     ///< false: no state received yet in this session
  bool is_displaying = true;  ///< false: observer, or not joined; zero force, whether states come or not
  /// The handle stands still in the world while the hand moves. A force computed from it would push the hand without
  /// end, with energy that has no source.
  bool is_clutched = false;
  bool sample_is_valid = true;
  double handle_speed_m_per_s = 0;
  Vec3 handle_v = Vec3::Zero();  ///< [m/s], in the wrench's frame
  bool is_room_slow = false;     ///< flag kFaultRoomSlow received from the server
};

/// Safety stages before the clamp. Called once a tick.
///
/// Model   gain g: rises by dt / start_ramp and is at most the silence gain, a smooth function of the state's age from
///         1 to 0.
///         The end of a silence is smooth as well. After a fault g falls by dt / fault_decay to 0 before it may rise
///         again.
///         It falls at the same rate while there is no state or nothing is displayed.
///         A handle that moves along a displayed force of 1 N or more at above 1 m/s counts as driven: no hand holds
///         it.
///         The clutch alone reduces the wrench no faster than 100 N/s and 5 N·m/s.
///         out = slew(g · wrench). While g falls, |out| ≤ |displayed before| · g / g_before, for force and torque each.
///         The part held back by this bound returns within 60 ms once g stops falling. Without a usable wrench
///         (no state, no sample, not finite, clutched) out is the displayed one · g / g_before. The decay after a fault
///         ends when zero has been displayed, not only computed.
///         While the loop is stopped (a stopped process, a suspended machine) the device holds the last force. A late
///         tick is therefore a fault and counts as one tick in time: the force decays from there in steps, for any
///         new wrench and age of the state.
///         For 0.5 s after a silence, or after a gap at most 15 ms shorter, the force changes by at most 0.28 N/ms.
///         The torque is limited to the same share of its slew limit. A decrease to zero still takes at most 15 ms. A
///         falling gain reduces the force by at most 0.25 N/ms.
/// Thread  haptic: no allocation, no throw
class SafetyChain {
 public:
  /// Fails   std::invalid_argument for settings that cannot keep the promises (names field, value and remedy)
  explicit SafetyChain(const SafetySettings& settings);
  /// Returns the wrench for the device writer; always finite.
  Wrench apply(LocalTime now, const SafetyInput& input) noexcept;
  /// Sets the wrench that was displayed after the clamp. The next change is measured from it, so that a clamped force
  /// does not wind up. Without this call the result of apply() counts.
  void set_displayed(const Wrench& wrench) noexcept { displayed_ = wrench; }
  /// Decays to zero over fault_decay, then starts the ramp again.
  void rearm() noexcept { latched_ |= kSafetyRamping; }
  /// Ramps down over fault_decay and stays at zero.
  void begin_shutdown() noexcept { is_stopping_ = true; }
  /// Returns true when zero is displayed and stays so until the gain rises.
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
  double fall_per_s_ = 0.0;      ///< rate of fall of the gain in a silence; decays after it
  double returning_s_ = 0.0;     ///< remaining time after a silence in which changes are limited more strictly
  double silent_force_n_ = 0.0;  ///< force displayed when the silence ended
  Wrench displayed_;
  /// Displayed share of the wrench times the gain. It falls while the gain falls and the wrench rises, then returns to
  /// 1.
  double shown_force_ = 1;
  double shown_torque_ = 1;
  SafetyFaults latched_ = 0;  ///< faults whose decay has not yet reached zero
  bool is_stopping_ = false;
  SafetyFaults faults_ = 0;
};

}  // namespace tandem::haptics

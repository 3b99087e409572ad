// The stages between a computed force and a hand, in their fixed order: ramp and decay, slew limit, finite
// check. The clamp is last of all, in devices/device_writer.hpp. Every stage only ever makes a force smaller,
// slower or zero.
//
//   gain   1 ┤          ________                 ______      rises with the start ramp only, falls with
//            │        ／        ＼             ／            silence (115 → 148 ms) or a fault (15 ms)
//          0 ┤______／            ＼__________／
//               start        silence      state again
//
// A promise to reach zero in time stands above the slew limit: while the gain falls, the output falls at least in
// the same proportion, and it is exactly zero when the gain is.
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
  kSafetySlewed = 1U << 2U,     ///< the change was limited
  kSafetyNotFinite = 1U << 3U,  ///< the computed wrench was NaN, infinite or absurd: zero, then re-armed by the ramp
  kSafetyTooFast = 1U << 4U,    ///< handle faster than the device's limit, or driven off: zero within 20 ms, re-armed
  kSafetyInvalidSample =
      1U << 5U,  ///< the device lost the hand, or says what no hand does: zero within 20 ms, then re-armed
  kSafetyStopping = 1U << 6U,       ///< shutting down
  kSafetyNotDisplaying = 1U << 7U,  ///< nothing is meant to be felt: an observer, or no session stands
  kSafetyClutched = 1U << 8U,       ///< the hand moves back: to zero by 0.1 N/ms at most, ramped in after release
  kSafetyLate = 1U << 9U,           ///< the loop stood still: zero within 20 ticks, then re-armed by the ramp
  kSafetySlow = 1U << 10U,  ///< the loop, or the server's room, runs at below 90 % of its rate: zero, then re-armed
};
using SafetyFaults = std::uint32_t;
/// One word a set bit, in bit order: "ramping", "silence", …
std::vector<std::string> safety_fault_names(SafetyFaults faults);
/// "ramping|slewed"; "none" for 0.
std::string describe_safety_faults(SafetyFaults faults);

struct SafetySettings {
  Duration start_ramp{from_seconds(0.5)};       ///< 0 → full force after start, a new connection, silence or a fault
  Duration silence_start{from_seconds(0.115)};  ///< since the last arrival: full force up to here …
  Duration silence_zero{from_seconds(0.148)};   ///< … and none from here on (promise: zero within 150 ms)
  Duration fault_decay{from_seconds(0.015)};    ///< to zero after a fault (promise: within 20 ms)
  Duration late_tick{from_seconds(0.020)};      ///< a tick that comes later than this is a fault
  Duration tick{from_seconds(0.001)};           ///< of the loop
  double slew_n_per_s = 4000.0;                 ///< set from DeviceSpec
  double slew_n_m_per_s = 200.0;
  double speed_limit_m_per_s = 3.0;
};

/// What the chain looks at besides the wrench.
struct SafetyInput {
  Wrench wrench;              ///< computed, on the hand
  Duration state_age{0};      ///< since the last arrival from the server
  bool has_state = false;     ///< false: none yet in this session
  bool is_displaying = true;  ///< false: observer, or not joined; zero force, whether states come or not
  /// The handle stands still in the world while the hand moves: a force computed from it would push the hand
  /// for ever, with work that nobody did.
  bool is_clutched = false;
  bool sample_is_valid = true;
  double handle_speed_m_per_s = 0;
  Vec3 handle_v = Vec3::Zero();  ///< [m/s], in the wrench's frame
  bool is_room_slow = false;     ///< the server says so (kFaultRoomSlow)
};

/// The stages before the clamp. One call a tick.
///
/// Model   gain g: rises by dt / start_ramp; g ≤ silence gain of the state's age, from 1 to 0 without a corner, as
///         there is none when the silence ends; after a fault it falls by dt / fault_decay to 0 before it may rise
///         again, and it falls so while there is no state or nothing to display.
///         A handle that runs along a force of 1 N or more, as displayed, at above 1 m/s is driven by it: no hand holds it.
///         The clutch alone lets go no faster than 100 N/s and 5 N·m/s.
///         out = slew(g · wrench), and while g falls |out| ≤ |displayed before| · g / g_before, for force and
///         torque each; what that kept back comes in again within 60 ms once g falls no more. Without a usable
///         wrench (no state, no sample, not finite, clutched) out is the displayed one · g / g_before. A fault's
///         fall is over when zero has been displayed, not only computed.
///         While the loop stood still (a stopped process, a suspended machine) the device held the last force: a late
///         tick is a fault and counts as a tick in time, so that the force falls from there in steps, whatever wrench
///         and age of the state are by then.
///         For 0.5 s after a silence, or a gap at most 15 ms shorter, the force changes by at most 0.28 N/ms, and the torque by
///         as large a share of its slew limit, but goes to zero within 15 ms; a gain that still falls takes at most 0.25 N/ms.
/// Thread  haptic: no allocation, no throw
class SafetyChain {
 public:
  /// Fails   std::invalid_argument for settings that cannot keep the promises (names field, value and remedy)
  explicit SafetyChain(const SafetySettings& settings);
  /// The wrench to hand to the device writer; always finite.
  Wrench apply(LocalTime now, const SafetyInput& input) noexcept;
  /// What the hand was really given, after the clamp: the next change is measured from there, so that a clamped
  /// force does not wind up. Without this call, what apply() returned counts.
  void set_displayed(const Wrench& wrench) noexcept { displayed_ = wrench; }
  /// Decays to zero over fault_decay, then starts the ramp again.
  void rearm() noexcept { latched_ |= kSafetyRamping; }
  /// Ramps down over fault_decay and stays at zero.
  void begin_shutdown() noexcept { is_stopping_ = true; }
  /// Nothing is displayed, and without a rise of the gain nothing will be.
  bool is_quiet() const noexcept;
  SafetyFaults faults() const noexcept { return faults_; }

 private:
  double advance_time(LocalTime now) noexcept;
  SafetyFaults present_faults(const SafetyInput& input) const noexcept;
  void update_gain(const SafetyInput& input, double elapsed_s, double rise_s) noexcept;
  double let_go_by(const SafetyInput& input, double elapsed_s) const noexcept;
  double silence_gain(Duration state_age) const noexcept;
  Wrench slewed(const Wrench& target, double rise_s) noexcept;

  SafetySettings settings_;
  realtime::RateWatch rate_;
  LocalTime last_time_{};
  bool has_time_ = false;
  double gain_ = 0.0;
  double fall_per_s_ = 0.0;      ///< of the gain in a silence; dies out after it
  double returning_s_ = 0.0;     ///< left of the time after a silence in which changes come in slowly
  double silent_force_n_ = 0.0;  ///< displayed when it ended
  Wrench displayed_;
  /// What of the wrench times the gain was shown while the gain fell and the wrench rose: back to all of it after.
  double shown_force_ = 1;
  double shown_torque_ = 1;
  SafetyFaults latched_ = 0;  ///< faults whose decay has not yet reached zero
  bool is_stopping_ = false;
  SafetyFaults faults_ = 0;
};

}  // namespace tandem::haptics

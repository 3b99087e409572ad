// The stages between a computed force and a hand, in their fixed order: ramp and decay, slew limit, finite
// check. The clamp is last of all, in devices/device_writer.hpp. Every stage only ever makes a force smaller,
// slower or zero.
#pragma once

#include <cstdint>
#include <string>

#include "common/spatial.hpp"
#include "common/time.hpp"

namespace tandem {

/// Why the displayed force differs from the computed one.
enum SafetyFault : std::uint32_t {
  kSafetyRamping = 1U << 0U,     ///< start ramp, or re-arming after a fault
  kSafetySilence = 1U << 1U,     ///< no server state for longer than silence_start: decaying or zero
  kSafetySlewed = 1U << 2U,      ///< the change was limited
  kSafetyNotFinite = 1U << 3U,   ///< the computed wrench was NaN or infinite: zero, then re-armed by the ramp
  kSafetyTooFast = 1U << 4U,     ///< handle faster than the device's limit: zero within 20 ms, then re-armed
  kSafetyInvalidSample = 1U << 5U,  ///< the device lost the hand: zero within 20 ms, then re-armed
  kSafetyStopping = 1U << 6U,    ///< shutting down
};
using SafetyFaults = std::uint32_t;
std::string describe_safety_faults(SafetyFaults faults);

struct SafetySettings {
  Duration start_ramp{from_seconds(0.5)};       ///< 0 → full force after start, a new connection or a fault
  Duration silence_start{from_seconds(0.060)};  ///< since the last arrival: full force up to here …
  Duration silence_zero{from_seconds(0.140)};   ///< … and none from here on (promise: zero within 150 ms)
  Duration fault_decay{from_seconds(0.015)};    ///< to zero after a fault (promise: within 20 ms)
  double slew_n_per_s = 4000.0;                 ///< set from DeviceSpec
  double slew_n_m_per_s = 200.0;
  double speed_limit_m_per_s = 3.0;
};

/// What the chain looks at besides the wrench.
struct SafetyInput {
  Wrench wrench;                 ///< computed, on the hand
  Duration state_age{0};         ///< since the last arrival from the server
  bool has_state = false;
  bool sample_is_valid = true;
  double handle_speed_m_per_s = 0;
};

/// The stages before the clamp. One call a tick.
///
/// Thread  haptic: no allocation, no throw
class SafetyChain {
 public:
  explicit SafetyChain(const SafetySettings& settings);
  /// The wrench to hand to the device writer; always finite.
  Wrench apply(LocalTime now, const SafetyInput& input) noexcept;
  /// Starts the ramp again from zero.
  void rearm() noexcept;
  /// Ramps down over fault_decay and stays at zero.
  void begin_shutdown() noexcept { is_stopping_ = true; }
  bool is_quiet() const noexcept;
  SafetyFaults faults() const noexcept { return faults_; }

 private:
  double silence_gain(const SafetyInput& input) const noexcept;

  SafetySettings settings_;
  LocalTime last_time_{};
  bool has_time_ = false;
  double gain_ = 0.0;            ///< of ramp and fault decay
  Wrench last_;                  ///< after the slew limit
  bool is_stopping_ = false;
  SafetyFaults faults_ = 0;
};

}  // namespace tandem

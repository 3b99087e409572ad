// Faults of one room step, as a bit mask: a step reports them without logging or throwing, and every user receives
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem {

/// Each bit documents a fault and its remedy. Sent to clients in ServerUpdate::tick_faults.
enum TickFault : std::uint32_t {
  /// A pose or velocity became non-finite; the body was reset to its start at rest.
  /// Remedy: soften the coupling, raise the tool's mass, or check whether the scene starts in deep overlap.
  kFaultNotFinite = 1U << 0U,
  /// A body was faster than limits.body_speed_m_per_s and was slowed to it. Remedy: as above, or raise the limit.
  kFaultSpeedLimited = 1U << 1U,
  /// The coupling force or torque of a tool was at its limit: past half of the transition to saturation.
  /// Remedy: none needed if rare; else soften the coupling.
  kFaultCouplingSaturated = 1U << 2U,
  /// The molecular field was bounded by molecular_field.force_limit_n: the molecules overlap.
  kFaultFieldLimited = 1U << 3U,
  /// A user's input is older than 115 ms: the tool is held softly in place. Remedy: check that user's network.
  kFaultInputStale = 1U << 4U,
  /// A step ended after its deadline (live only). Remedy: fewer bodies, fewer rooms, a faster machine.
  kFaultOverrun = 1U << 5U,
  /// Coupling, contact and friction did not converge within the allowed iterations; the last finite solution was used.
  /// Remedy: none needed if rare; else softer surfaces (contact_stiffness_n_per_m3) or heavier tools.
  kFaultContactUnsolved = 1U << 6U,
  /// More contacts than limits.contact_points or limits.contact_pairs allow: points represented their neighbours, or
  /// the last pairs of shapes were ignored. Remedy: raise the limit, or use shapes with fewer parts.
  kFaultContactCoarse = 1U << 7U,
  /// The step of the soft bodies was not ready when due (live only); the previous result stays in use. Remedy: fewer
  /// nodes or samples, a lower soft_step_rate_hz, a faster machine.
  kFaultSoftLate = 1U << 8U,
  /// A user's tool would have put more energy into the world than the hand supplied, and was limited. Remedy: a stage
  /// whose hand supplies the tool's energy (local-model, wave), or a shorter delay.
  kFaultToolEnergyLimited = 1U << 9U,
  /// The room steps at less than 90 % of its rate (live only); clients reduce the force to zero. Remedy: fewer bodies,
  /// contacts or atoms, a lower step_rate_hz, fewer rooms, a faster machine.
  kFaultRoomSlow = 1U << 10U,
  /// A body left the scene by more than limits.bounds_m and was reset to its start at rest. Remedy: none needed.
  kFaultOutOfBounds = 1U << 11U,
};
using TickFaults = std::uint32_t;
/// Number of fault bits.
inline constexpr std::size_t kTickFaultBits = 12;

/// One name per bit. Unknown bits of a newer server are shown ("bit_20"), not hidden.
std::vector<std::string> tick_fault_names(TickFaults faults);

/// Joined names, "not_finite|speed_limited"; "none" for 0.
std::string describe_faults(TickFaults faults);

}  // namespace tandem
